// Runs after page.js where a server explores the diagram anew: one slider for each fixed parameter. One
// question is under way at a time; of those that arise meanwhile only the last one is sent.
const {data, row, renew} = window.contfric;
const at = (id) => document.getElementById(id);
const params = {};
let [waiting, next] = [false, null];
window.contfric.redraws = 0;

function ask(quick) {
  next = {params: {...params}, row: row().name, quick};
  if (!waiting) send();
}

async function send() {
  waiting = next !== null;
  if (!waiting) return;
  const body = JSON.stringify(next);
  next = null;
  let found;
  try {
    found = await (await fetch("again", {method: "POST", body})).json();
  } catch {
    found = {trouble: "The server does not answer."};
  }
  send(); // the next diagram is explored while this one is drawn
  at("trouble").textContent = found.trouble ?? "";
  if (found.trouble) return;
  renew(found);
  requestAnimationFrame(() => (window.contfric.redraws += 1));
}

for (const {name, label, value, low, high} of data.steer) {
  params[name] = value;
  const line = document.createElement("label");
  const text = Object.assign(document.createElement("span"), {textContent: label});
  const slider = Object.assign(document.createElement("input"), {type: "range", min: low, max: high, step: (high - low) / 500});
  const number = Object.assign(document.createElement("output"), {textContent: value.toPrecision(4)});
  Object.assign(slider, {id: `steer-${name}`, value});
  slider.addEventListener("input", () => {
    params[name] = Number(slider.value);
    number.textContent = params[name].toPrecision(4);
    ask(true);
  });
  slider.addEventListener("change", () => ask(false)); // released: now with orbits to click on
  line.append(text, slider, number);
  at("steer").append(line);
}
at("steer").insertAdjacentHTML("beforeend", '<div id="trouble" role="status"></div>');
document.body.dataset.steer = "ready";
