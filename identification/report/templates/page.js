// Plots are drawn on canvases, which no style sheet reaches: this gives them the colours of the page, dark or light, wraps
// their legends on a narrow page, opens every recording for printing and gives print the light colours.
(() => {
  "use strict";
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const narrow = window.matchMedia("(max-width: 640px)");
  const inks = {
    light: { text: "#1c2127", soft: "#59626d", grid: "#e3e7eb" },
    dark: { text: "#e4e8ec", soft: "#a3adb8", grid: "#2d353f" },
  };

  function colours(model, ink) {
    if (model.type.endsWith("Axis")) {
      return { axis_label_text_color: ink.text, major_label_text_color: ink.soft, axis_line_color: ink.soft, major_tick_line_color: ink.soft };
    }
    if (model.type === "Grid") return { grid_line_color: ink.grid };
    if (model.type === "Legend") return { label_text_color: ink.text, ncols: narrow.matches ? 2 : 4 };
    if (model.tags.includes("ink")) {
      return model.type === "Line" ? { line_color: ink.text } : { fill_color: ink.text, hatch_color: ink.text };
    }
    return null;
  }

  function paint(ink) {
    for (const page of window.Bokeh ? Bokeh.documents : []) {
      for (const root of page.roots()) {
        for (const model of root.references()) {
          const wanted = colours(model, ink);
          if (wanted) model.setv(wanted);
        }
      }
    }
  }

  const repaint = () => paint(dark.matches ? inks.dark : inks.light);

  function whenDrawn() {
    if (window.Bokeh && Bokeh.documents.length > 0) repaint();
    else window.requestAnimationFrame(whenDrawn);
  }

  document.addEventListener("DOMContentLoaded", whenDrawn);
  dark.addEventListener("change", repaint);
  narrow.addEventListener("change", repaint);
  window.addEventListener("beforeprint", () => {
    for (const block of document.querySelectorAll("details")) block.open = true;
    paint(inks.light);
  });
  window.addEventListener("afterprint", repaint);
})();
