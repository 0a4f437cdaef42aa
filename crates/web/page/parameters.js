// The table of parameters: value, range, unit, meaning. Metadata is as ground stations download it.
const number = (value) =>
  Math.abs(value) >= 1e5 || (value !== 0 && Math.abs(value) < 1e-3)
    ? value.toExponential(2)
    : String(+value.toPrecision(6));

export class Parameters {
  constructor(body, filter, onSet) {
    this.body = body;
    this.onSet = onSet;
    this.rows = new Map();
    filter.addEventListener("input", () => this.filter(filter.value));
  }

  hello({ parameters }) {
    this.rows.clear();
    this.body.replaceChildren(...(parameters ?? []).map((parameter) => this.row(parameter)));
  }

  row(parameter) {
    const row = document.createElement("tr");
    const cell = (text, name = "") => {
      const made = row.insertCell();
      made.textContent = text;
      made.className = name;
      return made;
    };
    cell(parameter.name);
    const value = cell("", "value");
    const field = document.createElement(parameter.values ? "select" : "input");
    if (parameter.values) {
      field.append(...parameter.values.map((choice) => new Option(choice.description, choice.value)));
    } else {
      Object.assign(field, { type: "number", min: parameter.min, max: parameter.max, step: "any" });
    }
    field.setAttribute("aria-label", parameter.name);
    field.addEventListener("change", () => {
      const wanted = Number(field.value);
      if (field.value !== "" && Number.isFinite(wanted)) this.onSet(parameter.name, wanted);
    });
    value.append(field);
    cell(`${number(parameter.min)} to ${number(parameter.max)}`, "range");
    cell(parameter.units ?? "");
    cell(parameter.longDesc ?? parameter.shortDesc ?? "");
    this.rows.set(parameter.name, { row, field, value, parameter });
    return row;
  }

  values(values) {
    for (const [name, value] of Object.entries(values)) {
      const shown = this.rows.get(name);
      if (!shown || shown.field === document.activeElement) continue;
      shown.field.value = value;
      shown.value.classList.toggle("changed", Math.abs(value - shown.parameter.default) > 1e-6 * Math.abs(value));
    }
  }

  filter(text) {
    const words = text.toLowerCase().split(/\s+/).filter(Boolean);
    for (const { row } of this.rows.values()) {
      const has = row.textContent.toLowerCase();
      row.hidden = !words.every((word) => has.includes(word));
    }
  }
}
