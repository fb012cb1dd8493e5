// A live page: the server sends poses, which are shown at once; moving the time slider goes back to the recording.

function listen(story, stage, player, notice) {
  const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
  socket.onmessage = (event) => {
    const message = JSON.parse(event.data);
    if (message.type === "story") location.reload();
    if (message.type !== "poses") return;
    player.pause();
    message.position.forEach((position, k) => {
      stage.groups[k].position.fromArray(position);
      stage.groups[k].quaternion.fromArray(message.quaternion[k]).normalize();
    });
    stage.redraw();
    notice.textContent = "live";
    notice.className = "live";
  };
  socket.onclose = () => { notice.textContent = "the server has stopped"; notice.className = "stopped"; };
  player.onTime(() => { if (notice.className === "live") { notice.textContent = ""; notice.className = ""; } });
}
