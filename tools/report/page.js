"use strict";
// The contents are a list on wide screens and closed on small ones.
if (window.innerWidth < 1250) document.getElementById("contents").open = false;

// Scenes that turn: drawn when they come into view and let go when they leave it, because browsers
// allow few WebGL drawings at a time. Without plotly or WebGL the still figure stays.
(function () {
  const scenes = document.querySelectorAll(".scene");
  if (!window.Plotly || !scenes.length || !hasWebGL()) return;
  document.documentElement.classList.add("turns");

  function hasWebGL() {
    const canvas = document.createElement("canvas");
    return !!(canvas.getContext("webgl2") || canvas.getContext("webgl"));
  }

  function themed(given, width) {
    const style = getComputedStyle(document.documentElement);
    const ink = style.getPropertyValue("--ink").trim();
    const grid = style.getPropertyValue("--grid").trim();
    const data = given.data.map((trace) => ({
      ...trace, line: {...trace.line, color: trace.line.color === "#010203" ? ink : trace.line.color}
    }));
    const axis = {color: ink, gridcolor: grid, zerolinecolor: grid, showbackground: false};
    const scene = {...given.layout.scene};
    for (const name of ["xaxis", "yaxis", "zaxis"]) scene[name] = {...scene[name], ...axis};
    if (width < 500) scene.camera = {eye: {x: 2.1, y: 2.1, z: 1.6}};
    const layout = {...given.layout, scene, paper_bgcolor: "rgba(0,0,0,0)",
      modebar: {bgcolor: "rgba(0,0,0,0)", color: grid, activecolor: ink}, font: {color: ink}};
    return [data, layout, {responsive: true, displaylogo: false, scrollZoom: false}];
  }

  function draw(element) {
    const given = JSON.parse(element.querySelector("script").textContent);
    let target = element.querySelector("div");
    if (!target) {
      target = document.createElement("div");
      target.style.height = "100%";
      element.append(target);
    }
    Plotly.react(target, ...themed(given, element.clientWidth));
  }

  function drop(element) {
    const target = element.querySelector("div");
    if (target) { Plotly.purge(target); target.remove(); }
  }

  const seen = new Set();
  const watcher = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (entry.isIntersecting) { seen.add(entry.target); draw(entry.target); }
      else if (seen.delete(entry.target)) drop(entry.target);
    }
  }, {rootMargin: "200px"});
  scenes.forEach((scene) => watcher.observe(scene));
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change",
    () => seen.forEach(draw));
})();
