// One method's image against the truth, or against its difference from the truth, behind a boundary that can be moved.
const SIDES = [["truth", "Truth"], ["difference", "Difference"]];
const FACTS = ["flip", "psnr", "rmse", "hit_mismatch", "triangle_mismatch", "depth_median", "depth_p999",
  "projection_median", "projection_p95", "projection_max", "still_ms", "moving_ms", "shade_ms"];

function drawViewer(state) {
  const row = data.rows.find((candidate) => candidate.label === state.shown);
  const [image, difference] = data.images[state.shown];
  const other = state.against === "truth" ? "truth" : "difference";
  find("left-image").src = image;
  find("left-image").alt = `Image by ${row.label}`;
  find("right-image").src = other === "truth" ? data.truth : difference;
  find("right-image").alt = other === "truth" ? "The true image" : `FLIP difference of ${row.label} from the truth`;
  find("left-tag").textContent = row.label;
  find("right-tag").textContent = other === "truth" ? "truth" : "difference";
  find("canvas").style.width = `${state.zoom * 100}%`;
  find("canvas").classList.toggle("sharp", Number(state.zoom) > 1);
  const smaller = data.shrink > 1 ? ` Shown at 1/${data.shrink} of the size; the PNG files are whole.` : "";
  find("caption").textContent = (other === "truth"
    ? "Drag the boundary, or focus it and use the arrow keys: the method is on its left, the truth on its right."
    : "FLIP map: black where nothing differs, through purple and orange to white at 1. Its mean is the FLIP column.") + smaller;
  fillFacts(find("row-facts"), Object.fromEntries(FACTS.filter((name) => !Number.isNaN(number(row[name])))
    .map((name) => [data.columns[name].title, withUnit(row, name)])));
}

function setBoundary(percent) {
  const at = Math.min(Math.max(percent, 0), 100);
  find("canvas").style.setProperty("--at", `${at}%`);
  find("handle").setAttribute("aria-valuenow", String(Math.round(at)));
  find("handle").setAttribute("aria-valuetext", `${Math.round(at)} percent from the left`);
}

function startViewer() {
  const canvas = find("canvas"), handle = find("handle");
  const follow = (event) => {
    const area = canvas.getBoundingClientRect();
    setBoundary(((event.clientX - area.left) / area.width) * 100);
  };
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    event.preventDefault();
    handle.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    follow(event);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (canvas.hasPointerCapture(event.pointerId)) follow(event);
  });
  const steps = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10 };
  handle.addEventListener("keydown", (event) => {
    const now = Number(handle.getAttribute("aria-valuenow"));
    if (event.key in steps) setBoundary(now + steps[event.key] * (event.shiftKey ? 5 : 1));
    else if (event.key === "Home") setBoundary(0);
    else if (event.key === "End") setBoundary(100);
    else return;
    event.preventDefault();
  });
  setBoundary(50);
}
