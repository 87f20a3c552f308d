// Moves the charts beside viser's player to the time the player shows. The time is read from the player's slider, from the
// value it states for assistive technology; a click in a chart goes to that time through the player's own time field.
// Where a player has neither, the charts stand still and the rest works.
(() => {
  "use strict";
  const run = window.CDFCTL_RUN, box = document.getElementById("cdfctl");
  const x = (t) => run.left + (run.width * t) / Math.max(run.duration, 1e-9);

  // What holds at t: the last entry begun.
  function index(times, t) {
    let k = 0;
    while (k + 1 < times.length && times[k + 1] <= t + 1e-6) k++;
    return k;
  }

  function show(t) {
    t = Math.min(t, run.duration);
    const k = index(run.steps, t), bad = run.infeasible[k] === 1, now = box.querySelector(".now");
    now.textContent = `t = ${t.toFixed(2)} s` + (bad ? ": no velocity satisfies all rows" : "");
    now.classList.toggle("bad", bad);
    for (const cursor of box.querySelectorAll(".cursor")) {
      cursor.setAttribute("x1", x(t));
      cursor.setAttribute("x2", x(t));
    }
    run.charts.forEach((chart, i) => {
      const at = index(chart.t, t);
      box.querySelectorAll(`ul[data-chart="${i}"] .value`).forEach((label, c) => {
        const value = chart.curves[c][at];
        label.textContent = value === null ? "none" : value.toFixed(3);
      });
    });
  }

  function goTo(t) {
    const field = document.querySelector("input[inputmode]");
    if (field === null) return;
    // React listens to the setter of the prototype, not to that of the element.
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(field, t.toFixed(2));
    field.dispatchEvent(new Event("input", { bubbles: true }));
  }

  for (const svg of box.querySelectorAll("svg")) {
    svg.addEventListener("click", (event) => {
      const share = (event.clientX - svg.getBoundingClientRect().left - run.left) / run.width;
      goTo(Math.min(Math.max(share, 0), 1) * run.duration);
    });
  }

  // The player begins at once; who asks for less motion gets it standing, and starts it with the space bar or the button.
  let still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  let last = null;
  (function follow() {
    const slider = document.querySelector('[role="slider"][aria-valuenow]');
    const t = slider === null ? 0 : Number(slider.getAttribute("aria-valuenow"));
    if (still && t > 0) {  // not before: at its first tick the player builds the scene
      still = false;
      window.dispatchEvent(new KeyboardEvent("keydown", { code: "Space" }));
    }
    if (t !== last && Number.isFinite(t)) show((last = t));
    requestAnimationFrame(follow);
  })();
})();
