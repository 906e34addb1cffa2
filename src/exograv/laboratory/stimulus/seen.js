(() => {
  const at = (id) => document.getElementById(id);
  const centre = (element) => {
    const found = element.getBoundingClientRect();
    return [found.left + found.width / 2, found.top + found.height / 2];
  };
  const shows = (element) => element !== null && element.checkVisibility();
  const target = at("target"), arrow = at("arrow"), isTask = shows(target);
  const box = isTask ? target.getBoundingClientRect() : null;
  const hasArrow = arrow !== null && !arrow.hasAttribute("hidden");
  return {
    screen: document.body?.dataset.screen ?? "",
    target_px: isTask ? centre(target) : null,
    diameter_px: isTask ? box.width : null,
    shape: hasArrow ? arrow.dataset.shape : null,
    colour: hasArrow ? arrow.dataset.colour : null,
    agree_px: shows(at("agree")) ? centre(at("agree")) : null,
    countdown: at("countdown")?.textContent ?? "",
    unsent: document.body?.dataset.screen ? JSON.parse(localStorage.getItem("touches") ?? "[]").length : 0,
  };
})()
