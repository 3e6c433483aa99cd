// Elements are made here, always from text: nothing that comes from a file is read as HTML.

/**
 * @typedef {object} Options
 * @property {string} [class]
 * @property {string} [text]
 * @property {Record<string, string | number | boolean | null | undefined>} [attributes]
 * @property {Record<string, (event: any) => void>} [on]
 */

/**
 * Makes an element.
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag
 * @param {Options} [options]
 * @param {...(Node | string | null)} children
 * @returns {HTMLElementTagNameMap[K]}
 */
export function element(tag, options = {}, ...children) {
    const made = document.createElement(tag);
    if (options.class) made.className = options.class;
    if (options.text !== undefined) made.textContent = options.text;
    for (const [name, value] of Object.entries(options.attributes ?? {})) {
        if (value === true) made.setAttribute(name, '');
        else if (value !== false && value != null) made.setAttribute(name, String(value));
    }
    for (const [name, listener] of Object.entries(options.on ?? {})) made.addEventListener(name, listener);
    made.append(...children.filter((child) => child !== null));
    return made;
}

/**
 * The element of index.html with this id.
 * @template {HTMLElement} [T=HTMLElement]
 * @param {string} id
 * @returns {T}
 */
export function byId(id) {
    const found = document.getElementById(id);
    if (!found) throw new Error(`there is no element ${id}`);
    return /** @type {T} */ (found);
}

/**
 * One of the drawings in index.html.
 * @param {string} name
 */
export function icon(name) {
    const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
    svg.setAttribute('class', 'icon');
    svg.setAttribute('aria-hidden', 'true');
    const use = document.createElementNS('http://www.w3.org/2000/svg', 'use');
    use.setAttribute('href', `#icon-${name}`);
    svg.append(use);
    return svg;
}

/**
 * A button with a drawing, and a name for the tooltip and for screen readers.
 * @param {string} drawing
 * @param {string} name
 * @param {(event: MouseEvent) => void} click
 * @param {string} [keys]
 */
export function iconButton(drawing, name, click, keys) {
    const title = keys ? `${name} (${keys})` : name;
    const attributes = { type: 'button', title, 'aria-label': name };
    return element('button', { class: 'icon-button', attributes, on: { click } }, icon(drawing));
}

/**
 * Opens a modal dialog and removes it when it is closed.
 * @param {string} title
 * @param {(Node | string)[]} content
 * @param {{wide?: boolean, onClose?: () => void}} [options]
 */
export function openDialog(title, content, options = {}) {
    const name = `dialog-${Date.now()}`;
    const close = iconButton('close', 'Close', () => dialog.close(), 'Esc');
    const head = element('header', {}, element('h2', { text: title, attributes: { id: name } }), close);
    // Long pages are scrolled with keys, too.
    const attributes = options.wide ? { tabindex: 0 } : {};
    const body = element('div', { class: 'dialog-body', attributes }, ...content);
    const dialog = element(
        'dialog',
        {
            class: options.wide ? 'wide' : '',
            attributes: { 'aria-labelledby': name },
        },
        head,
        body,
    );
    dialog.addEventListener('close', () => {
        dialog.remove();
        options.onClose?.();
    });
    dialog.addEventListener('click', (event) => {
        if (event.target === dialog) dialog.close();
    });
    document.body.append(dialog);
    dialog.showModal();
    // Enter does what the dialog is for, and does not close it.
    const usual = ['[autofocus]', 'form :is(input, select, textarea)', '.dialog-body .primary'];
    const first = usual.map((each) => dialog.querySelector(each)).find(Boolean);
    if (first instanceof HTMLElement) first.focus();
    return dialog;
}

/**
 * Asks for a yes.
 * @param {string} title
 * @param {string} text
 * @param {string} yes
 * @returns {Promise<boolean>}
 */
export async function ask(title, text, yes) {
    return (await choose(title, text, ['Cancel', yes])) === 1;
}

/**
 * Asks which of some answers is meant; the last is the usual one. Answers its number, or null.
 * @param {string} title
 * @param {string} text
 * @param {string[]} answers
 * @returns {Promise<number | null>}
 */
export function choose(title, text, answers) {
    return new Promise((resolve) => {
        /** @type {number | null} */
        let chosen = null;
        const buttons = answers.map((answer, at) =>
            element('button', {
                class: at === answers.length - 1 ? 'primary' : '',
                text: answer,
                attributes: { type: 'button' },
                on: {
                    click: () => {
                        chosen = at;
                        dialog.close();
                    },
                },
            }),
        );
        const row = element('div', { class: 'dialog-buttons' }, ...buttons);
        const dialog = openDialog(title, [element('p', { text }), row], { onClose: () => resolve(chosen) });
    });
}

/**
 * A number of things: `1 target`, `2 targets`.
 * @param {number} count
 * @param {string} word
 */
export function counted(count, word) {
    return `${count} ${word}${count === 1 ? '' : 's'}`;
}

/**
 * Offers a file to save.
 * @param {Blob} blob
 * @param {string} name
 */
export function save(blob, name) {
    const address = URL.createObjectURL(blob);
    const link = element('a', { attributes: { href: address, download: name } });
    document.body.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(address), 60_000);
}
