"use strict";
(() => {
  const SILENT_MS = 1300, LOOK_MS = 200, ASK_MS = 1000;
  const alarm = document.getElementById("alarm");
  const shown = new Map();
  let last = performance.now(), asking = false, asked = 0;

  // Pieces of the page, and where the reader is in it.
  const put = (place, html) => {
    const element = document.getElementById(place);
    if (!element || shown.get(place) === html) return;
    shown.set(place, html);
    const focused = element.contains(document.activeElement) ? document.activeElement.id : null;
    element.innerHTML = html;
    if (focused) document.getElementById(focused)?.focus({ preventScroll: true });
  };

  // The page says by itself that data stopped: whoever could tell it is gone.
  const look = () => {
    const silent = performance.now() - last;
    const lost = silent > SILENT_MS;
    document.body.classList.toggle("lost", lost);
    alarm.hidden = !lost;
    if (!lost) return;
    const words = `No data for ${Math.round(silent / 1000)} s: the monitor does not answer. The values are old.`;
    if (alarm.textContent !== words) alarm.textContent = words;
    ask();
  };

  // Until it answers again; then everything is loaded anew, because what was open there is forgotten.
  const ask = async () => {
    if (asking || performance.now() - asked < LOOK_MS) return;
    asking = true;
    asked = performance.now();
    try {
      const answer = await fetch("/alive", { cache: "no-store", redirect: "manual", signal: AbortSignal.timeout(ASK_MS) });
      if (answer.ok || answer.status === 401) {
        await new Promise((then) => setTimeout(then, 500));
        if (performance.now() - last > SILENT_MS) location.reload();
      }
    } catch { /* not yet */ }
    asking = false;
  };

  const begin = () => {
    const held = window.Bokeh?.documents[0], beat = held?.get_model_by_name("beat");
    if (!beat) { setTimeout(begin, 30); return; }
    for (const place of beat.get("places")[0]) {
      const piece = held.get_model_by_name(place), show = () => put(place, piece.get("html")[0]);
      piece.properties.data.change.connect(show);
      show();
    }
    const beaten = () => {
      last = performance.now();
      document.body.dataset.beats = beat.get("beat")[0];
    };
    beat.properties.data.change.connect(beaten);
    beaten();
    document.addEventListener("change", (event) => {
      const choice = held.get_model_by_name("choice");
      if (event.target.id === "recording" && choice) choice.data = { file: [event.target.value] };
    });
  };
  begin();
  setInterval(look, LOOK_MS);
})();
