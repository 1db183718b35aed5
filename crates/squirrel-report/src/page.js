"use strict";
// Turns 3-D scenes by dragging; the formulas are those that drew the first view.
for (const svg of document.querySelectorAll("svg.scene")) {
  const numbers = (text) => text.split(",").map(Number);
  const [width, height, top, edge] = numbers(svg.dataset.frame);
  const [halfE, halfN, halfH] = numbers(svg.dataset.half);
  let [azimuth, elevation] = numbers(svg.dataset.view);
  const solid = svg.querySelector(".solid");
  const lines = [...svg.querySelectorAll("[data-p]")].map((node) => ({ node, points: node.dataset.p.split(" ").map(numbers) }));
  const cylinders = [...svg.querySelectorAll("[data-c]")].map((node) => ({ node, c: numbers(node.dataset.c) }));
  const labels = [...svg.querySelectorAll("[data-t]")].map((node) => {
    const [axis, value, offset] = node.dataset.t.split(",");
    return { node, axis, value: +value, offset: +offset };
  });
  const draw = () => {
    const [sa, ca, se, ce] = [Math.sin(azimuth), Math.cos(azimuth), Math.sin(elevation), Math.cos(elevation)];
    const zoom = Math.min(1, ((height - top - edge) / 2) / (Math.hypot(halfE, halfN) * se + halfH * ce));
    const view = ([e, n, h]) => {
      const [right, away] = [e * ca + n * sa, n * ca - e * sa];
      const y = (height + top - edge) / 2 - zoom * (h * ce + away * se);
      return [(width / 2 + zoom * right).toFixed(1), y.toFixed(1), away * ce - h * se];
    };
    const order = [];
    for (const { node, points } of lines) {
      const seen = points.map(view);
      const depth = seen[seen.length >> 1][2];
      if (node.tagName === "circle") {
        node.setAttribute("cx", seen[0][0]);
        node.setAttribute("cy", seen[0][1]);
      } else {
        node.setAttribute("d", "M" + seen.map((p) => p[0] + " " + p[1]).join(" "));
      }
      if (node.parentNode === solid) order.push([node.tagName === "circle" ? depth - 4 : depth, node]);
    }
    for (const { node, c: [e, n, floor, radius] } of cylinders) {
      const [x, low] = view([e, n, floor]).map(Number);
      const high = +view([e, n, -floor])[1];
      const [rx, ry] = [zoom * radius, zoom * radius * se];
      const [left, right, arc] = [x - rx, x + rx, `A${rx} ${ry} 0 0 0`];
      node.setAttribute("d", `M${left} ${low}${arc} ${right} ${low}L${right} ${high}${arc} ${left} ${high}ZM${left} ${high}${arc} ${right} ${high}`);
      order.push([view([e, n, 0])[2], node]);
    }
    order.sort((a, b) => b[0] - a[0]).forEach(([, node]) => solid.appendChild(node));
    const [front, side] = [ca < 0 ? -1 : 1, sa < 0 ? -1 : 1];
    for (const { node, axis, value, offset } of labels) {
      const [x, y] = view(axis === "e" ? [value, -front * (halfN + offset), -halfH]
        : axis === "n" ? [side * (halfE + offset), value, -halfH]
          : [-front * (halfE + offset), -side * (halfN + offset), value]);
      node.setAttribute("x", x);
      node.setAttribute("y", y);
    }
  };
  svg.addEventListener("pointerdown", (event) => svg.setPointerCapture(event.pointerId));
  svg.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    azimuth += event.movementX * 0.007;
    elevation = Math.min(1.57, Math.max(0.05, elevation + event.movementY * 0.007));
    draw();
  });
}
// One cursor through all charts of a link.
const linked = [...document.querySelectorAll("svg[data-link]")].map((svg) => {
  const make = (tag, name) => {
    const node = document.createElementNS("http://www.w3.org/2000/svg", tag);
    node.setAttribute("class", name);
    return svg.appendChild(node);
  };
  const [left, top, right, bottom] = svg.dataset.box.split(",").map(Number);
  const [lo, hi] = svg.dataset.range.split(",").map(Number);
  const [line, text] = [make("line", "cursor"), make("text", "cursor-text")];
  const show = (at) => {
    const inside = at >= lo && at <= hi;
    for (const node of [line, text]) node.style.visibility = inside ? "visible" : "hidden";
    const x = left + ((at - lo) / (hi - lo)) * (right - left);
    for (const [name, value] of Object.entries({ x1: x, x2: x, y1: top, y2: bottom })) line.setAttribute(name, value);
    const atRight = x > (left + right) / 2;
    text.setAttribute("x", atRight ? x - 6 : x + 6);
    text.setAttribute("y", top + 12);
    text.setAttribute("text-anchor", atRight ? "end" : "start");
    text.textContent = at.toPrecision(4) + " " + svg.dataset.unit;
  };
  return { svg, show, left, right, lo, hi };
});
// A page with an instant of its own ("squirrel:time") keeps the cursor there, and hears where a chart was pressed.
let instant = NaN;
document.addEventListener("squirrel:time", (event) => {
  instant = event.detail;
  for (const { svg, show } of linked) if (svg.dataset.link === "time") show(instant);
});
for (const chart of linked) {
  const same = linked.filter((other) => other.svg.dataset.link === chart.svg.dataset.link);
  const under = (event) => {
    const box = chart.svg.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * chart.svg.viewBox.baseVal.width;
    return chart.lo + ((x - chart.left) / (chart.right - chart.left)) * (chart.hi - chart.lo);
  };
  chart.svg.addEventListener("pointermove", (event) => {
    for (const other of same) other.show(under(event));
  });
  chart.svg.addEventListener("pointerleave", () => {
    for (const other of same) other.show(instant);
  });
  chart.svg.addEventListener("click", (event) => {
    document.dispatchEvent(new CustomEvent("squirrel:pick", { detail: under(event) }));
  });
}
