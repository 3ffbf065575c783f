// Runs once bokeh has drawn the page. bokeh hands over the figures (top, phase, series) and the
// sources of their glyphs by name; contfric/plot/live/page.py makes them.
const data = JSON.parse(document.getElementById("contfric-data").textContent);
const lines = {stable: stable_lines, unstable: unstable_lines, unknown: unknown_lines, bridge: bridge_lines};
const by_id = (id) => document.getElementById(id);
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
const floats = (text) => Array.from(new Float32Array(bytes(text)));
const quantised = ([low, step, text]) => Array.from(new Uint16Array(bytes(text)), (n) => low + step * n);
const hidden = new Set(); // names of branches that are switched off
let shown_marks = [];
let selected = null;

const row = () => data.rows[by_id("row").selectedIndex];
const is_shown = (i) => {
  const branch = data.branches[i];
  const off = branch.bridge ? !by_id("bridges").checked : hidden.has(branch.name);
  return !off && !row().left_out.includes(i);
};
const name_is_on = (name) =>
  data.branches.some((b) => b.name === name && (b.bridge ? by_id("bridges").checked : !hidden.has(name)));

function draw() {
  const found = {};
  for (const style in lines) found[style] = {x: [], y: [], colour: []};
  let [low, high] = [Infinity, -Infinity];
  for (const run of data.runs) {
    if (!is_shown(run.branch)) continue;
    for (const column of run.y[row().name] ?? []) {
      const y = floats(column);
      found[run.style].x.push(floats(run.x));
      found[run.style].y.push(y);
      found[run.style].colour.push(data.branches[run.branch].colour);
      for (const v of y) if (v === v) [low, high] = [Math.min(low, v), Math.max(high, v)];
    }
  }
  for (const style in lines) lines[style].data = found[style];
  draw_marks();
  return [low, high];
}

function fit([low, high]) {
  const margin = low < high ? 0.12 * (high - low) : 0.5;
  if (low > high) [low, high] = [0, 1];
  top.y_range.setv({start: low - margin, end: high + margin, reset_start: low - margin, reset_end: high + margin});
  top.left[0].axis_label = row().label;
}

function draw_marks() {
  const on = by_id("events").checked;
  shown_marks = row().marks.filter(
    (m) => on && (!m.on_bridges || by_id("bridges").checked) &&
      (m.branches.length === 0 || m.branches.some(name_is_on)));
  const columns = {x: [], y: [], shape: [], angle: [], face: [], size: [], label: [], meaning: []};
  for (const mark of shown_marks) {
    const look = data.looks[mark.kind] ?? data.looks.other;
    for (const y of mark.y) {
      for (const key of ["shape", "angle", "face"]) columns[key].push(look[key]);
      columns.size.push(mark.on_bridges ? 0.6 * look.size : look.size);
      for (const key of ["x", "label", "meaning"]) columns[key].push(mark[key]);
      columns.y.push(y);
    }
  }
  marks.data = columns;
  thin();
}

// Pixels for one unit of each axis.
const scales = () => [
  (top.inner_width || 800) / (top.x_range.end - top.x_range.start),
  (top.inner_height || 380) / (top.y_range.end - top.y_range.start)];

// A label that would lie on an earlier one is left out until there is space: zooming in shows it.
function thin() {
  const [sx, sy] = scales();
  const kept = [];
  const rank = (m) => (m.kind === "T" ? 2 : m.on_bridges ? 1 : 0);
  for (const mark of [...shown_marks].sort((a, b) => rank(a) - rank(b))) {
    const label = {x: mark.x, y: Math.max(...mark.y), label: mark.label};
    const inside = label.x >= top.x_range.start && label.x <= top.x_range.end;
    const free = kept.every((other) =>
      Math.abs(other.x - label.x) * sx > 3.4 * (other.label.length + label.label.length) + 4 ||
      Math.abs(other.y - label.y) * sy > 14);
    if (inside && free) kept.push(label);
  }
  labels.data = {x: kept.map((k) => k.x), y: kept.map((k) => k.y), label: kept.map((k) => k.label)};
}

function pick(x, y) {
  const [sx, sy] = scales();
  let [best, nearest] = [Infinity, null];
  for (const point of data.points) {
    if (!is_shown(point.branch) || (point.event && !by_id("events").checked)) continue;
    for (const value of point.y[row().name]) {
      const far = value === null ? Infinity : Math.hypot((point.x - x) * sx, (value - y) * sy);
      if (far < best) [best, nearest] = [far, point];
    }
  }
  if (nearest) show(nearest);
  return nearest;
}

// Every margin with what it is, the smallest first.
const margins_of = (point) =>
  floats(point.margins).map((value, k) => [value, data.systems[point.system].watched[k]])
    .sort((a, b) => a[0] - b[0]).map(([value, what]) => `${Number(value.toPrecision(4))} (${what})`);

function show(point) {
  selected = point;
  mark_selected();
  const branch = data.branches[point.branch];
  const stability = point.stable === null ? "not computed" : point.stable ? "stable" : "unstable";
  const facts = {
    orbit: branch.name + (branch.mirrored ? ", mirror image" : ""),
    [data.parameter]: String(Number(point.x.toPrecision(12))),
    signature: data.systems[point.system].signature,
    stability: branch.bridge ? "bridge: the least disturbance ends its hold" : stability,
    "Floquet multipliers": point.multipliers ? point.multipliers.join(", ") : branch.bridge ? "none" : "not computed",
    "smallest margin": margins_of(point)[0] ?? "none is watched",
    period: String(point.period),
    [data.autonomous ? "cycles" : "periods of the excitation"]: String(point.periods),
  };
  if (point.event) {
    facts.event = point.event;
    delete facts.stability;
  }
  const table = by_id("facts");
  table.replaceChildren();
  for (const [name, value] of Object.entries(facts)) {
    const line = table.insertRow();
    const head = document.createElement("th");
    head.textContent = name;
    line.append(head);
    line.insertCell().textContent = value;
  }
  by_id("margins").replaceChildren(...margins_of(point).map(
    (text) => Object.assign(document.createElement("li"), {textContent: text})));
  draw_orbit();
}

function mark_selected() {
  if (!selected) return;
  const values = is_shown(selected.branch) ? selected.y[row().name].filter((v) => v !== null) : [];
  chosen.data = {x: values.map(() => selected.x), y: values};
}

// Cubics through the samples, with the slopes of parabolas through three of them; a jump (no time passes) stays.
function smooth(t, y) {
  const h = (k) => t[k + 1] - t[k];
  const d = (k) => (y[k + 1] - y[k]) / h(k);
  const inner = (k) => k > 0 && k + 1 < t.length && h(k - 1) > 0 && h(k) > 0;
  const slope = (k) => (h(k) * d(k - 1) + h(k - 1) * d(k)) / (h(k - 1) + h(k));
  const end = (k, other) => (inner(other) ? (3 * d(k) - slope(other)) / 2 : d(k));
  const found = [y[0]];
  for (let k = 0; k + 1 < t.length; k++) {
    const [q, r] = [[k, k + 1], [k + 1, k]].map(([at, other]) => h(k) * (inner(at) ? slope(at) : end(k, other)));
    const p = y[k + 1] - y[k];
    for (const s of [0.25, 0.5, 0.75, 1])
      found.push(h(k) > 0 ? y[k] + s * (q + s * (3 * p - 2 * q - r + s * (q + r - 2 * p))) : y[k + 1]);
  }
  return found;
}

function draw_orbit() {
  if (!selected) return;
  const t = quantised(selected.t);
  const states = selected.s.map(quantised);
  const seen = {t: [], s: states.map(() => [])}; // piece by piece: across a joint nothing is smooth
  const [a, b] = [by_id("abscissa").selectedIndex, by_id("ordinate").selectedIndex];
  const pieces = {x: [], y: [], colour: [], domain: []};
  const starts = {x: [], y: [], colour: [], domain: []};
  selected.parts.forEach(([from, name], k) => {
    const domain = data.names[name];
    const to = k + 1 < selected.parts.length ? selected.parts[k + 1][0] + 1 : t.length;
    const colour = data.domains[domain] ?? "black";
    const piece = (y) => smooth(t.slice(from, to), y.slice(from, to));
    pieces.x.push(piece(states[a]));
    pieces.y.push(piece(states[b]));
    seen.t.push(...piece(t));
    states.forEach((y, i) => seen.s[i].push(...piece(y)));
    starts.x.push(states[a][from]);
    starts.y.push(states[b][from]);
    for (const part of [pieces, starts]) {
      part.colour.push(colour);
      part.domain.push(domain);
    }
  });
  parts.data = pieces;
  joints.data = starts;
  curves.data = {x: states.map(() => seen.t), y: seen.s, colour: data.state_colours, state: data.states};
  phase.below[0].axis_label = data.states[a];
  phase.left[0].axis_label = data.states[b];
}

function fill(select, names, index) {
  for (const name of names) select.add(new Option(name));
  select.selectedIndex = Math.min(index, names.length - 1);
}

fill(by_id("row"), data.rows.map((r) => r.label), 0);
fill(by_id("abscissa"), data.states, 0);
fill(by_id("ordinate"), data.states, 1);

function list_branches() {
  by_id("branches").replaceChildren();
  for (const name of new Set(data.branches.filter((b) => !b.bridge).map((b) => b.name))) {
    const label = document.createElement("label");
    const box = Object.assign(document.createElement("input"), {type: "checkbox", checked: !hidden.has(name), value: name});
    const text = document.createElement("span");
    text.textContent = " " + name;
    text.style.color = data.branches.find((b) => b.name === name && !b.bridge).colour;
    label.append(box, text);
    by_id("branches").append(label);
  }
}

// Another diagram of the same model: all of it, or what is seen of one row while a parameter is dragged.
function renew(found) {
  for (const r of found.rows) data.rows[data.rows.findIndex((old) => old.name === r.name)] = r;
  Object.assign(data, {branches: found.branches, runs: found.runs, systems: found.systems ?? [], names: found.names ?? [], points: found.points ?? []});
  by_id("fixed").textContent = found.fixed;
  list_branches();
  const [low, high] = draw();
  if (low < top.y_range.start || high > top.y_range.end) fit([low, high]);
  if (found.points) pick(selected?.x ?? (data.range[0] + data.range[1]) / 2, chosen.data.y[0] ?? (low + high) / 2);
  else chosen.data = {x: [], y: []};
}

list_branches();
by_id("controls").addEventListener("change", (event) => {
  if (event.target.closest("#branches")) {
    if (event.target.checked) hidden.delete(event.target.value);
    else hidden.add(event.target.value);
  }
  const extent = draw();
  if (event.target.id === "row") fit(extent);
  thin();
  mark_selected();
});
for (const id of ["abscissa", "ordinate"]) by_id(id).addEventListener("change", draw_orbit);
window.contfric = {data, pick, show, thin, row, renew};
fit(draw());
thin();
const stable = data.points.filter((p) => p.stable);
if (data.points.length > 0) show(stable[stable.length >> 1] ?? data.points[0]);
document.body.dataset.contfric = "ready"; // tests wait for it
