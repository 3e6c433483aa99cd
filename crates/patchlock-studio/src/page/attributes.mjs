// Attributes: what labels declare, and the values of the selected target.

import { byId, element, icon, iconButton, openDialog } from './dom.mjs';

/** @typedef {import('./editor.mjs').Editor} Editor */
/** @typedef {import('./types').Attribute} Attribute */
/** @typedef {import('./types').Target} Target */

const KINDS = /** @type {const} */ ([
    ['checkbox', 'yes or no'],
    ['select', 'one of a list'],
    ['number', 'number'],
    ['text', 'text'],
]);

/**
 * The attributes that the label of a target declares.
 * @param {Editor} editor
 * @param {string} [label]
 */
function declared(editor, label) {
    return editor.clip?.project.labels.find(({ name }) => name === label)?.attributes ?? [];
}

/**
 * Whether an attribute can have a value; the program has the last word.
 * @param {Attribute} attribute
 * @param {string} value
 */
function allows(attribute, value) {
    if (attribute.kind === 'checkbox') return value === 'true' || value === 'false';
    if (attribute.kind === 'select') return attribute.values?.includes(value) ?? false;
    if (attribute.kind === 'text') return [...value].length <= (attribute.length ?? 0);
    const { min = 0, max = 0, step = 1 } = attribute;
    const [number, steps] = [Number(value), (Number(value) - min) / step];
    return value !== '' && number >= min && number <= max && Math.abs(steps - Math.round(steps)) < 1e-6;
}

/**
 * The value of an attribute in a frame, and the frame of the change that it is from, if any.
 * @param {Target} target
 * @param {Attribute} attribute
 * @param {number} frame
 */
export function valueAt(target, attribute, frame) {
    const changes = attribute.mutable ? target.changes?.[attribute.name] : undefined;
    const from = Object.keys(changes ?? {})
        .map(Number)
        .filter((at) => at <= frame)
        .reduce((last, at) => Math.max(last, at), -1);
    const value = changes?.[from] ?? target.attributes[attribute.name];
    const known = value !== undefined && allows(attribute, value);
    return { value: known ? value : attribute.default, from: from < 0 ? null : from };
}

/** The values of the selected target in the panel. */
export class Values {
    /** @param {Editor} editor */
    constructor(editor) {
        this.editor = editor;
        this.shown = '';
        /** @type {{attribute: Attribute, control: HTMLInputElement | HTMLSelectElement, since: HTMLElement, back: HTMLElement}[]} */
        this.rows = [];
    }

    render() {
        const { editor } = this;
        const { track, frame } = editor;
        const attributes = declared(editor, track?.target.label);
        const shown = JSON.stringify([editor.clip?.info.id, track?.target.id, attributes]);
        // While the target stays the same, its controls do, too: the focus is not lost.
        if (shown !== this.shown) {
            this.shown = shown;
            this.rows = attributes.map((attribute, at) => this.#row(attribute, at));
            byId('values').replaceChildren(
                ...this.rows.map(({ attribute, control, since, back }) =>
                    element(
                        'div',
                        { class: 'value-row' },
                        element('label', { text: attribute.name, attributes: { for: control.id } }),
                        control,
                        since,
                        back,
                    ),
                ),
            );
            byId('values').hidden = attributes.length === 0;
        }
        if (!track) return;
        for (const { attribute, control, since, back } of this.rows) {
            const { value, from } = valueAt(track.target, attribute, frame);
            since.textContent = from === null ? '' : `from ${from}`;
            back.style.visibility = from === frame ? 'visible' : 'hidden';
            if (this.pending) continue;
            if (control instanceof HTMLInputElement && control.type === 'checkbox') {
                control.checked = value === 'true';
            } else if (control.value !== value && (control !== document.activeElement || !this.typing)) {
                control.value = value;
            }
        }
    }

    /** Values that are on their way to the program: the controls show them already. */
    pending = 0;

    /** Whether a text is being typed that is not sent yet. */
    typing = false;

    /**
     * @param {Attribute} attribute
     * @param {number} at
     */
    #row(attribute, at) {
        const control = controlOf(attribute, `value-${at}`);
        const read = () =>
            control instanceof HTMLInputElement && control.type === 'checkbox'
                ? String(control.checked)
                : control.value.trim();
        control.addEventListener('input', () => (this.typing = true));
        control.addEventListener('blur', () => (this.typing = false));
        control.addEventListener('change', () => {
            this.typing = false;
            void this.#set(attribute, read());
        });
        const since = element('span', { class: 'since faint numbers' });
        const back = iconButton('undo', `Take back the change of ${attribute.name}`, () => {
            // The button goes with the change.
            control.focus();
            void this.#set(attribute, undefined);
        });
        return { attribute, control, since, back };
    }

    /**
     * @param {Attribute} attribute
     * @param {string | undefined} value
     */
    async #set({ name, mutable }, value) {
        const { track, clip, frame } = this.editor;
        if (!track || !clip) return;
        const at = mutable ? { frame } : {};
        this.pending += 1;
        const made = await clip.edit([{ edit: 'set_value', target: track.target.id, name, ...at, value }]);
        this.pending -= 1;
        // What was refused is not shown as if it held.
        if (!made) this.shown = '';
        this.render();
    }
}

/**
 * What an attribute is entered with.
 * @param {Attribute} attribute
 * @param {string} id
 */
function controlOf({ kind, values, min, max, step, length }, id) {
    if (kind === 'select') {
        const options = (values ?? []).map((value) =>
            element('option', { text: value, attributes: { value } }),
        );
        return element('select', { attributes: { id } }, ...options);
    }
    if (kind === 'checkbox') return element('input', { attributes: { id, type: 'checkbox' } });
    if (kind === 'number') return element('input', { attributes: { id, type: 'number', min, max, step } });
    return element('input', { attributes: { id, type: 'text', maxlength: length } });
}

/**
 * The attributes that a label declares: added, changed and removed.
 * @param {Editor} editor
 * @param {string} label
 */
export function openSchema(editor, label) {
    const { clip } = editor;
    if (!clip) return;
    const list = element('ul', { class: 'schema-rows' });
    for (const attribute of declared(editor, label)) list.append(schemaRow(attribute));
    const more = element(
        'button',
        {
            attributes: { type: 'button' },
            on: {
                click: () => {
                    const row = schemaRow({ name: '', kind: 'checkbox', default: 'false', mutable: true });
                    list.append(row);
                    row.querySelector('input')?.focus();
                },
            },
        },
        icon('add'),
        'Add attribute',
    );
    const done = element('button', { class: 'primary', text: 'Save', attributes: { type: 'submit' } });
    const submit = async (/** @type {Event} */ event) => {
        event.preventDefault();
        const attributes = [...list.children].map((row) => readRow(/** @type {HTMLElement} */ (row)));
        if (await clip.edit([{ edit: 'declare', label, attributes }])) dialog.close();
    };
    const hint = element('p', {
        class: 'hint',
        text:
            'The attributes are those of all clips. Values that are no longer allowed stay in the files and ' +
            'count as the default. What is changed here is not undone with Ctrl+Z.',
    });
    const form = element(
        'form',
        { on: { submit } },
        hint,
        list,
        element('div', { class: 'dialog-buttons' }, more, done),
    );
    const dialog = openDialog(`Attributes of the label ${label}`, [form]);
}

/**
 * A row of the schema. Its controls are found by `data-part`.
 * @param {Attribute} attribute
 */
function schemaRow(attribute) {
    const part = (/** @type {string} */ name) => ({ 'data-part': name });
    const field = (/** @type {string} */ text, /** @type {HTMLElement} */ control) =>
        element('label', { class: 'field' }, element('span', { text }), control);
    const number = (/** @type {string} */ name, /** @type {number} */ value) =>
        element('input', { attributes: { ...part(name), type: 'number', step: 'any', value } });
    const kind = element(
        'select',
        { attributes: part('kind') },
        ...KINDS.map(([name, text]) => element('option', { text, attributes: { value: name } })),
    );
    kind.value = attribute.kind;
    const values = element('textarea', {
        text: (attribute.values ?? []).join('\n'),
        attributes: { ...part('values'), rows: 3 },
    });
    const fields = {
        select: [field('Values, one a line', values)],
        number: [
            field('From', number('min', attribute.min ?? 0)),
            field('To', number('max', attribute.max ?? 10)),
            field('Step', number('step', attribute.step ?? 1)),
        ],
        text: [field('Longest, in characters', number('length', attribute.length ?? 100))],
        checkbox: [],
    };
    const details = element('div', { class: 'schema-details' }, ...Object.values(fields).flat());
    const first = element('input', {
        attributes: { ...part('default'), value: attribute.default, maxlength: 1000 },
    });
    const show = () => {
        for (const [name, controls] of Object.entries(fields)) {
            for (const control of controls) control.hidden = name !== kind.value;
        }
    };
    kind.addEventListener('change', () => {
        first.value = kind.value === 'checkbox' ? 'false' : '';
        show();
    });
    show();
    const mutable = element('input', {
        attributes: { ...part('mutable'), type: 'checkbox', checked: attribute.mutable },
    });
    const name = element('input', {
        attributes: {
            ...part('name'),
            value: attribute.name,
            maxlength: 100,
            // Values are found by the name.
            readonly: attribute.name !== '',
            required: true,
        },
    });
    const remove = iconButton('delete', `Remove ${attribute.name || 'the new attribute'}`, () =>
        row.remove(),
    );
    const row = element(
        'li',
        {},
        element(
            'div',
            { class: 'schema-head' },
            field('Name', name),
            field('Kind', kind),
            field('Default', first),
            remove,
        ),
        details,
        element('label', { class: 'check' }, mutable, 'May change from frame to frame'),
    );
    return row;
}

/**
 * @param {HTMLElement} row
 * @returns {Attribute}
 */
function readRow(row) {
    const get = (/** @type {string} */ part) => {
        const found = row.querySelector(`[data-part=${part}]`);
        return /** @type {HTMLInputElement} */ (found);
    };
    const kind = /** @type {Attribute['kind']} */ (get('kind').value);
    const numbers = (/** @type {string[]} */ ...parts) =>
        Object.fromEntries(parts.map((part) => [part, get(part).valueAsNumber || 0]));
    const ofKind = {
        checkbox: {},
        select: {
            values: get('values')
                .value.split('\n')
                .map((value) => value.trim())
                .filter(Boolean),
        },
        number: numbers('min', 'max', 'step'),
        text: numbers('length'),
    }[kind];
    const first = get('default').value.trim();
    // Without a default, it is the first value.
    const given = first || kind === 'text' ? { default: first } : {};
    const { checked: mutable } = get('mutable');
    return /** @type {Attribute} */ ({ name: get('name').value.trim(), kind, ...ofKind, ...given, mutable });
}

/**
 * Names and values of the whole target that its label does not declare.
 * @param {Editor} editor
 */
export async function openAttributes(editor) {
    const { clip } = editor;
    const track = await editor.settledTarget();
    if (!track || !clip) return;
    const { attributes: all, label } = track.target;
    const known = new Set(declared(editor, label).map(({ name }) => name));
    const isKnown = (/** @type {[string, string]} */ [name]) => known.has(name);
    const kept = Object.entries(all).filter(isKnown);
    const rows = element('div', { class: 'attribute-rows' });
    const add = (/** @type {string} */ name, /** @type {string} */ value) => {
        const row = element(
            'div',
            { class: 'attribute-row' },
            element('input', {
                attributes: { value: name, placeholder: 'name', 'aria-label': 'Name', maxlength: 100 },
            }),
            element('input', {
                attributes: { value, placeholder: 'value', 'aria-label': 'Value', maxlength: 1000 },
            }),
            iconButton('delete', 'Remove', () => row.remove()),
        );
        rows.append(row);
        return row;
    };
    for (const [name, value] of Object.entries(all)) if (!known.has(name)) add(name, value);
    const more = element(
        'button',
        {
            attributes: { type: 'button' },
            on: {
                click: () => add('', '').querySelector('input')?.focus(),
            },
        },
        icon('add'),
        'Add',
    );
    const done = element('button', { class: 'primary', text: 'Save', attributes: { type: 'submit' } });
    const form = element(
        'form',
        {
            on: {
                submit: (event) => {
                    event.preventDefault();
                    const inputs = [...rows.querySelectorAll('.attribute-row')].map((row) =>
                        [...row.querySelectorAll('input')].map(({ value }) => value.trim()),
                    );
                    const given = inputs.filter(([name]) => name).map(([name, value]) => [name, value]);
                    const attributes = Object.fromEntries([...kept, ...given]);
                    dialog.close();
                    void clip.edit([{ edit: 'set_target', target: track.target.id, attributes }]);
                },
            },
        },
        element('p', {
            class: 'hint',
            text:
                'Of the whole target, in every frame; such as colour: red. Attributes of all targets of a ' +
                'label, which may change from frame to frame, are declared beside the labels (L).',
        }),
        rows,
        element('div', { class: 'dialog-buttons' }, more, done),
    );
    if (rows.children.length === 0) add('', '');
    const dialog = openDialog(`Attributes of ${label} ${track.target.id}`, [form]);
}
