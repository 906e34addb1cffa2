// Lock of a touch page: no zoom, no scrolling, no selection, no context menu.
export function lockPage() {
  const prevent = (event) => event.preventDefault();
  for (const kind of ["contextmenu", "selectstart", "dragstart", "gesturestart", "gesturechange", "dblclick"]) {
    document.addEventListener(kind, prevent);
  }
  document.addEventListener("touchmove", prevent, { passive: false });
  document.addEventListener("wheel", prevent, { passive: false });
  document.addEventListener("keydown", (event) => {
    if ((event.ctrlKey || event.metaKey) && ["+", "-", "=", "0"].includes(event.key)) event.preventDefault();
  });
}
