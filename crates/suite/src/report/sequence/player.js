"use strict";
(() => {
  const root = document.getElementById("player");
  const data = JSON.parse(document.getElementById("player-data").textContent);
  const panels = [...root.querySelectorAll("img[data-panel]")];
  const slider = root.querySelector("[name=frame]");
  const play = root.querySelector("[name=play]");
  const speed = root.querySelector("[name=speed]");
  const output = root.querySelector("output");
  let at = 0;
  let timer = null;

  // Every picture is asked for once, so that playing does not wait for the disk.
  const ready = data.frames.map(() => null);
  const load = (k) => {
    if (!ready[k]) {
      ready[k] = data.frames[k].files.map((file) => {
        const image = new Image();
        image.src = file;
        return image;
      });
    }
    return ready[k];
  };

  const show = (k) => {
    at = (k + data.frames.length) % data.frames.length;
    load(at).forEach((image, i) => { panels[i].src = image.src; });
    for (let next = 1; next <= 4; next += 1) load((at + next) % data.frames.length);
    slider.value = at;
    const frame = data.frames[at];
    output.textContent = `frame ${frame.index}, ${(frame.index / data.rate * 1000).toFixed(0)} ms`;
  };

  const stop = () => {
    clearInterval(timer);
    timer = null;
    play.textContent = "play";
  };
  const start = () => {
    stop();
    timer = setInterval(() => show(at + 1), 1000 / (data.rate * Number(speed.value)));
    play.textContent = "pause";
  };

  play.addEventListener("click", () => (timer ? stop() : start()));
  speed.addEventListener("change", () => { if (timer) start(); });
  slider.addEventListener("input", () => { stop(); show(Number(slider.value)); });
  document.addEventListener("keydown", (event) => {
    if (event.target.matches("input, select, button, summary")) return;
    if (event.key === "ArrowRight") { stop(); show(at + 1); }
    else if (event.key === "ArrowLeft") { stop(); show(at - 1); }
    else if (event.key === " ") { if (timer) stop(); else start(); }
    else return;
    event.preventDefault();
  });
  show(0);
})();
