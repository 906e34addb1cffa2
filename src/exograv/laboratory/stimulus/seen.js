(() => {
  const at = (id) => document.getElementById(id);
  const shows = (element) => element !== null && element.checkVisibility();
  const target = at("target"), arrow = at("arrow"), isTask = shows(target);
  const box = isTask ? target.getBoundingClientRect() : null;
  const hasArrow = arrow !== null && !arrow.hasAttribute("hidden");
  return {
    screen: document.body?.dataset.screen ?? "",
    target_px: isTask ? [box.left + box.width / 2, box.top + box.height / 2] : null,
    diameter_px: isTask ? box.width : null,
    shape: hasArrow ? arrow.dataset.shape : null,
    colour: hasArrow ? arrow.dataset.colour : null,
    countdown: at("countdown")?.textContent ?? "",
    unsent: document.body?.dataset.screen ? JSON.parse(localStorage.getItem("touches") ?? "[]").length : 0,
  };
})()
