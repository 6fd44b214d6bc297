// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// Zoom a plot by the wheel or two fingers, and pan it by dragging: along time, and along the chain.

/**
 * Return a uPlot plugin.
 *
 * @param {object} view get() and set(x, y, zoom) the ranges [low, high]; all() shows everything;
 *   y is null if only time can be changed.
 */
export function zoomable(view) {
  const pointers = new Map();
  let pinch = 0;

  const around = ([low, high], at, factor) => [at - (at - low) * factor, at + (high - at) * factor];

  function ready(plot) {
    const over = plot.over;
    const box = () => over.getBoundingClientRect();

    over.addEventListener('wheel', (event) => {
      event.preventDefault();
      const { left, top } = box();
      const factor = Math.exp(Math.max(-60, Math.min(60, event.deltaY || event.deltaX)) * 0.006);
      const { x, y } = view.get();
      if (event.shiftKey && y) view.set(x, around(y, plot.posToVal(event.clientY - top, 'y'), factor));
      else view.set(around(x, plot.posToVal(event.clientX - left, 'x'), factor), y, true);
    }, { passive: false });

    over.addEventListener('pointerdown', (event) => {
      pointers.set(event.pointerId, event);
      over.setPointerCapture(event.pointerId);
    });
    over.addEventListener('pointermove', (event) => {
      const before = pointers.get(event.pointerId);
      if (!before) return;
      pointers.set(event.pointerId, event);
      const { x, y } = view.get();
      if (pointers.size === 2) {
        const [a, b] = [...pointers.values()];
        const apart = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
        const at = plot.posToVal((a.clientX + b.clientX) / 2 - box().left, 'x');
        if (pinch) view.set(around(x, at, pinch / apart), y, true);
        pinch = apart;
        return;
      }
      const shift = ((before.clientX - event.clientX) * (x[1] - x[0])) / over.clientWidth;
      const rise = y ? ((event.clientY - before.clientY) * (y[1] - y[0])) / over.clientHeight : 0;
      if (shift || rise) view.set(x.map((v) => v + shift), y && y.map((v) => v + rise));
    });
    for (const name of ['pointerup', 'pointercancel']) {
      over.addEventListener(name, (event) => { pointers.delete(event.pointerId); pinch = 0; });
    }
    over.addEventListener('dblclick', () => view.all());
  }

  return { hooks: { ready } };
}
