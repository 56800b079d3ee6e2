"use strict";
(async () => {
  const data = JSON.parse(document.getElementById("pictures").textContent);
  const [width, height] = data.size;
  const element = (id) => document.getElementById(id);
  const status = element("pixel");
  element("viewer").hidden = false;

  // Values of 16 bits: first the high bytes of all, then the low ones, packed by zlib.
  const halves = new Float32Array(65536);
  for (let i = 0; i < 65536; i++) {
    const sign = i & 0x8000 ? -1 : 1, exponent = (i >> 10) & 31, fraction = i & 1023;
    if (exponent === 31) halves[i] = fraction ? NaN : sign * Infinity;
    else halves[i] = sign * (exponent ? 2 ** (exponent - 15) * (1 + fraction / 1024) : 2 ** -24 * fraction);
  }
  async function unpack(text) {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    const raw = new Uint8Array(await new Response(stream).arrayBuffer());
    const count = raw.length / 2, out = new Float32Array(count);
    for (let i = 0; i < count; i++) out[i] = halves[(raw[i] << 8) | raw[count + i]];
    return out;
  }
  const unpacked = new Map();
  async function picture(index) {
    if (!unpacked.has(index)) unpacked.set(index, await unpack(index < 0 ? data.reference : data.tests[index].data));
    return unpacked.get(index);
  }

  // From black by red and yellow to white.
  function heat(x) {
    x = Math.min(Math.max(x, 0), 1);
    return [255 * Math.min(1, 2.2 * x), 255 * Math.min(1, Math.max(0, 2.2 * x - 0.8)), 255 * Math.min(1, Math.max(0, 3 * x - 2))];
  }
  const srgb = (x) => 255 * (x <= 0.0031308 ? 12.92 * Math.max(x, 0) : 1.055 * Math.pow(Math.min(x, 1), 1 / 2.4) - 0.055);
  const relative = (t, r) => (t - r) * (t - r) / (r * r + data.floor);
  const errors = {
    relative: (r, t, gain) => heat(gain * (relative(t[0], r[0]) + relative(t[1], r[1]) + relative(t[2], r[2])) / 3),
    absolute: (r, t, gain) => [0, 1, 2].map((c) => srgb(gain * Math.abs(t[c] - r[c]))),
    signed: (r, t, gain) => {
      const d = gain * (0.2126 * (t[0] - r[0]) + 0.7152 * (t[1] - r[1]) + 0.0722 * (t[2] - r[2]));
      return d > 0 ? [255, 255 * (1 - Math.min(d, 1)), 255 * (1 - Math.min(d, 1))] : [255 * (1 - Math.min(-d, 1)), 255 * (1 - Math.min(-d, 1)), 255];
    },
  };

  const views = ["reference", "test", "error"].map((name) => ({ name, figure: element("view-" + name), canvas: element("view-" + name).querySelector("canvas") }));
  const layers = views.map(() => Object.assign(document.createElement("canvas"), { width, height }));
  let reference, test, shown = "all", zoom = 1, left = 0, top = 0;

  function tone() {
    const exposure = 2 ** Number(element("exposure").value), gain = 2 ** Number(element("gain").value), of = errors[element("kind").value];
    element("exposure-value").textContent = Number(element("exposure").value).toFixed(1);
    element("gain-value").textContent = Number(element("gain").value).toFixed(1);
    layers.forEach((layer, k) => {
      const context = layer.getContext("2d"), image = context.createImageData(width, height);
      for (let i = 0; i < width * height; i++) {
        const r = [reference[3 * i], reference[3 * i + 1], reference[3 * i + 2]], t = [test[3 * i], test[3 * i + 1], test[3 * i + 2]];
        let color;
        if (k === 2) color = of(r, t, gain);
        else color = (k === 0 ? r : t).map((x) => srgb(exposure * x));
        // What is not a number is magenta.
        if ((k === 0 ? r : t).some((x) => !Number.isFinite(x))) color = [255, 0, 255];
        image.data.set([color[0], color[1], color[2], 255], 4 * i);
      }
      context.putImageData(image, 0, 0);
    });
    draw();
  }
  function draw() {
    for (const [k, view] of views.entries()) {
      view.figure.hidden = shown !== "all" && shown !== view.name;
      if (view.figure.hidden) continue;
      // As wide as there is room for, and not higher than the window.
      const room = Math.min(view.figure.clientWidth || width, 0.85 * innerHeight * width / height);
      view.canvas.width = Math.max(1, Math.round(room));
      view.canvas.height = Math.max(1, Math.round(room * height / width));
      const context = view.canvas.getContext("2d"), size = view.canvas.width / width * zoom;
      context.imageSmoothingEnabled = size < 1;
      context.setTransform(size, 0, 0, size, -left * size, -top * size);
      context.drawImage(layers[k], 0, 0);
    }
    element("zoom-value").textContent = zoom.toFixed(1);
  }
  function limit() {
    left = Math.min(Math.max(left, 0), width - width / zoom);
    top = Math.min(Math.max(top, 0), height - height / zoom);
  }
  // The point of the picture below the pointer.
  function place(event) {
    const box = event.currentTarget.getBoundingClientRect();
    return [left + (event.clientX - box.left) / box.width * width / zoom, top + (event.clientY - box.top) / box.height * height / zoom];
  }
  function tell(x, y) {
    x = Math.min(Math.max(Math.floor(x), 0), width - 1);
    y = Math.min(Math.max(Math.floor(y), 0), height - 1);
    const i = 3 * (y * width + x), text = (p) => [p[i], p[i + 1], p[i + 2]].map((v) => v.toPrecision(4)).join(" ");
    const error = [0, 1, 2].reduce((sum, c) => sum + relative(test[i + c], reference[i + c]) / 3, 0);
    status.textContent = `(${x}, ${y})  reference ${text(reference)}  test ${text(test)}  relative squared error ${error.toPrecision(3)}`;
  }
  function show(name) {
    shown = name;
    for (const button of document.querySelectorAll("[data-show]")) button.setAttribute("aria-pressed", button.dataset.show === name);
    draw();
  }

  let held = null;
  for (const view of views) {
    view.canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const [x, y] = place(event), before = zoom;
      zoom = Math.min(Math.max(zoom * 2 ** (-event.deltaY / 300), 1), 64);
      left = x - (x - left) * before / zoom;
      top = y - (y - top) * before / zoom;
      limit();
      draw();
    }, { passive: false });
    view.canvas.addEventListener("pointerdown", (event) => { held = place(event); view.canvas.setPointerCapture(event.pointerId); });
    view.canvas.addEventListener("pointerup", () => { held = null; });
    view.canvas.addEventListener("pointermove", (event) => {
      const [x, y] = place(event);
      if (held) {
        left += held[0] - x;
        top += held[1] - y;
        limit();
        draw();
      }
      tell(x, y);
    });
    view.canvas.addEventListener("dblclick", () => { zoom = 1; left = top = 0; draw(); });
  }
  async function choose() {
    test = await picture(Number(element("choice").value));
    tone();
    tell(width / 2, height / 2);
  }
  data.tests.forEach((one, i) => element("choice").append(new Option(one.name, i)));
  element("choice").value = data.tests.length - 1;
  element("choice").addEventListener("change", choose);
  for (const id of ["exposure", "gain", "kind"]) element(id).addEventListener("input", tone);
  for (const button of document.querySelectorAll("[data-show]")) button.addEventListener("click", () => show(button.dataset.show));
  addEventListener("keydown", (event) => {
    const name = { 0: "all", 1: "reference", 2: "test", 3: "error" }[event.key];
    if (name) show(name);
  });
  addEventListener("resize", draw);
  try {
    reference = await picture(-1);
    await choose();
    show("all");
    document.body.dataset.viewer = "ready";
  } catch (error) {
    status.textContent = `The pictures cannot be shown (this needs DecompressionStream): ${error.message}`;
  }
})();
