// The region that a point can be in, see-through.

function addReach(stage, show, reach, read) {
  if (!reach) return;
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(read(reach.positions), 3));
  geometry.setIndex(new THREE.BufferAttribute(read(reach.faces), 1));
  geometry.computeVertexNormals();
  const color = new THREE.Color(0x1b5e9e).convertSRGBToLinear();
  const group = new THREE.Group();
  group.name = "reach";
  // The far side first, then the near one, so that the inside can be seen.
  for (const side of [THREE.BackSide, THREE.FrontSide]) {
    const mesh = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ color, transparent: true, opacity: 0.16, depthWrite: false, side, roughness: 0.9 }));
    mesh.renderOrder = side === THREE.BackSide ? 1 : 2;
    group.add(mesh);
  }
  stage.root.add(group);
  show.add("reach", `reach: ${reach.name}`, true, (on) => { group.visible = on; });
}
