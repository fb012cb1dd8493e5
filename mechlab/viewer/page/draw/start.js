// Opens the empty plane and offers it to scripts as window.lab.

function startDrawing() {
  const view = new PlaneView(document.getElementById("plane"));
  const panel = new DrawPanel(document.getElementById("panel"));
  const drawing = new Drawing(view, panel);
  panel.fill(drawing);
  view.fit([]);
  drawing.show();
  window.lab = { ready: true, drawing, view, PageModel, PoseSolver, documentText };
}

startDrawing();
