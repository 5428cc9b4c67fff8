// Controls, built from labels and native inputs, so that keys and screen readers reach them all.

let numbers = 0;

export class Panel {
  constructor(readonly root: HTMLElement) {}

  // Controls that belong together, and can be hidden together.
  section(name: string): Panel {
    const section = new Panel(element('section', {}));
    section.heading(name);
    this.root.append(section.root);
    return section;
  }

  heading(text: string): void {
    this.root.append(element('h2', { textContent: text }));
  }

  note(text: string, id = ''): HTMLElement {
    const note = element('p', { textContent: text, className: 'note', id });
    this.root.append(note);
    return note;
  }

  // A slider that says its value, and a colour beside it if `colour` is given.
  slider(name: string, options: SliderOptions): Slider {
    const row = element('div', { className: 'row' });
    numbers += 1;
    const id = `control-${numbers}`;
    const label = element('label', { textContent: name, htmlFor: id });
    const output = element('output', {});
    output.htmlFor.add(id);
    const input = element('input', { type: 'range', id, min: `${options.low}`, max: `${options.high}`, step: `${options.step}` });
    row.append(label, output, input);
    const tell = () => {
      output.value = options.text(input.valueAsNumber);
      input.setAttribute('aria-valuetext', output.value);
    };
    const set = (value: number) => {
      input.value = `${value}`;
      tell();
    };
    set(options.value);
    input.addEventListener('input', () => {
      tell();
      options.changed();
    });
    let colour: HTMLInputElement | undefined;
    if (options.colour !== undefined) {
      colour = element('input', { type: 'color', value: options.colour });
      colour.setAttribute('aria-label', `Colour of ${name}`);
      colour.addEventListener('input', options.changed);
      row.append(colour);
    }
    this.root.append(row);
    return { value: () => input.valueAsNumber, set, colour };
  }

  check(name: string, changed: (on: boolean) => void): HTMLInputElement {
    const label = element('label', { className: 'check' });
    const input = element('input', { type: 'checkbox' });
    input.addEventListener('change', () => changed(input.checked));
    label.append(input, element('span', { textContent: name }));
    this.root.append(label);
    return input;
  }

  choice(name: string, items: string[], changed: (index: number) => void): HTMLSelectElement {
    const select = element('select', {});
    items.forEach((text, value) => select.append(element('option', { textContent: text, value: `${value}` })));
    select.setAttribute('aria-label', name);
    select.addEventListener('change', () => changed(select.selectedIndex));
    this.root.append(select);
    return select;
  }

  // A colour that is told once it is chosen.
  colour(name: string, changed: (value: string) => void): HTMLInputElement {
    const label = element('label', { className: 'check' });
    const input = element('input', { type: 'color' });
    input.addEventListener('change', () => changed(input.value));
    label.append(input, name);
    this.root.append(label);
    return input;
  }

  button(name: string, pressed: () => void): void {
    const button = element('button', { type: 'button', textContent: name });
    button.addEventListener('click', pressed);
    this.root.append(button);
  }
}

export interface SliderOptions {
  low: number; high: number; step: number; value: number; colour?: string;
  text: (value: number) => string; changed: () => void;
}

export interface Slider { value: () => number; set: (value: number) => void; colour?: HTMLInputElement }

function element<K extends keyof HTMLElementTagNameMap>(name: K, properties: Partial<HTMLElementTagNameMap[K]>): HTMLElementTagNameMap[K] {
  return Object.assign(document.createElement(name), properties);
}

// Three significant digits, as the program's messages have them.
export function significant(value: number): string {
  if (value === 0 || !Number.isFinite(value)) return `${value}`;
  const digits = 2 - Math.floor(Math.log10(Math.abs(value)));
  return digits > 0 ? `${+value.toFixed(Math.min(digits, 40))}` : value.toFixed(0);
}
