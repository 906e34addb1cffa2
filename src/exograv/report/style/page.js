// Save a figure of this page as SVG or PNG: a copy of every figure in two formats would treble the page.
const DPI = 300, POINTS = 72;
function save(url, name) {
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
}
for (const button of document.querySelectorAll("button[data-kind]")) {
  button.addEventListener("click", () => {
    const drawn = button.closest("figure").querySelector("svg"), copy = drawn.cloneNode(true);
    const [, , width, height] = drawn.getAttribute("viewBox").split(" ").map(Number);
    const name = button.closest("section").id || "figure";
    copy.setAttribute("width", width + "pt");
    copy.setAttribute("height", height + "pt");
    const text = new XMLSerializer().serializeToString(copy);
    const url = "data:image/svg+xml;charset=utf-8," + encodeURIComponent(text);
    if (button.dataset.kind === "svg") return save(url, name + ".svg");
    const picture = new Image();
    picture.onload = () => {
      const canvas = document.createElement("canvas");
      canvas.width = Math.round(width * DPI / POINTS);
      canvas.height = Math.round(height * DPI / POINTS);
      canvas.getContext("2d").drawImage(picture, 0, 0, canvas.width, canvas.height);
      save(canvas.toDataURL("image/png"), name + ".png");
    };
    picture.src = url;
  });
}
// A table that a small screen cuts off says so.
function mark() {
  for (const one of document.querySelectorAll(".scroll")) one.classList.toggle("wider", one.scrollWidth > one.clientWidth + 1);
}
addEventListener("resize", mark);
mark();
// A print shows what is folded.
const closed = [];
addEventListener("beforeprint", () => {
  for (const one of document.querySelectorAll("details:not([open])")) { one.open = true; closed.push(one); }
});
addEventListener("afterprint", () => { while (closed.length) closed.pop().open = false; });
