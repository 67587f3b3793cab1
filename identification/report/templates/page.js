// Plots are drawn on canvases, which no style sheet reaches: this gives them the colours of the page, dark or light,
// wraps their legends on a narrow page, and prepares the page for printing.
(() => {
  "use strict";
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const narrow = window.matchMedia("(max-width: 640px)");
  const inks = {
    light: { text: "#1c2127", soft: "#59626d", grid: "#e3e7eb" },
    dark: { text: "#e4e8ec", soft: "#a3adb8", grid: "#2d353f" },
  };
  let painted = "light";
  let printing = false;

  function colours(model, ink) {
    if (model.type.endsWith("Axis")) {
      return {
        axis_label_text_color: ink.text, major_label_text_color: ink.soft,
        axis_line_color: ink.soft, major_tick_line_color: ink.soft,
      };
    }
    if (model.type === "Grid") return { grid_line_color: ink.grid };
    if (model.type === "Legend") return { label_text_color: ink.text, ncols: narrow.matches ? 2 : 4 };
    if (model.tags.includes("ink")) {
      const wanted = {};
      for (const name of ["line_color", "fill_color", "hatch_color"]) if (name in model.properties) wanted[name] = ink.text;
      return wanted;
    }
    return null;
  }

  function paint() {
    if (printing) return;
    painted = dark.matches ? "dark" : "light";
    for (const drawing of Bokeh.documents) {
      for (const root of drawing.roots()) {
        for (const model of root.references()) {
          const wanted = colours(model, inks[painted]);
          if (wanted) model.setv(wanted);
        }
      }
    }
  }

  function start() {
    if (Bokeh.documents.length === 0) {
      window.requestAnimationFrame(start);
      return;
    }
    paint();
    dark.addEventListener("change", paint);
    narrow.addEventListener("change", paint);
  }

  document.addEventListener("DOMContentLoaded", start);

  // A canvas cannot be drawn anew between the order to print and the print: a dark one is inverted by the style sheet.
  window.addEventListener("beforeprint", () => {
    printing = true;
    document.documentElement.classList.toggle("night", painted === "dark");
    for (const block of document.querySelectorAll("details")) block.open = true;
  });
  window.addEventListener("afterprint", () => {
    printing = false;
    document.documentElement.classList.remove("night");
    paint();
  });
})();
