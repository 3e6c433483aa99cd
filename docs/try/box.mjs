// The box around the object: drawn with the pointer, moved with keys, or typed.

/** @typedef {import('./patchlock/patchlock.js').Box} Box */

/** Pixels that a key moves an edge by, for each arrow: right, down. @type {Record<string, [number, number]>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
/** A box that is smaller is a slip of the hand. */
const LEAST = 4;

export class BoxEditor {
    #stage;
    #fields;
    #changed;
    /** Where the pointer went down. @type {[number, number] | undefined} */
    #from;
    /** Whether the box may be changed. */
    enabled = false;

    /** @param {HTMLCanvasElement} stage @param {HTMLInputElement[]} fields left, top, width, height
     * @param {() => void} changed */
    constructor(stage, fields, changed) {
        this.#stage = stage;
        this.#fields = fields;
        this.#changed = changed;
        for (const field of fields) field.addEventListener('input', changed);
        stage.addEventListener('pointerdown', (event) => this.#begin(event));
        stage.addEventListener('pointermove', (event) => this.#move(event));
        stage.addEventListener('pointerup', () => (this.#from = undefined));
        stage.addEventListener('pointercancel', () => (this.#from = undefined));
        stage.addEventListener('keydown', (event) => this.#key(event));
    }

    /** The box, if all fields are filled. @returns {Box | undefined} */
    get box() {
        const [x, y, w, h] = this.#fields.map((field) => field.valueAsNumber);
        return [x, y, w, h].every(Number.isFinite) ? { x, y, w, h } : undefined;
    }

    /** A box in the middle of the frame. */
    centre() {
        const { width, height } = this.#stage;
        const side = Math.round(Math.min(width, height) / 4);
        this.#set([Math.round((width - side) / 2), Math.round((height - side) / 2), side, side]);
    }

    /** @param {number[]} values */
    #set(values) {
        this.#fields.forEach((field, k) => (field.valueAsNumber = values[k] ?? 0));
        this.#changed();
    }

    /** The pixel under the pointer: the frame may be shown smaller, with bars beside it. @param {PointerEvent} event
     * @returns {[number, number]} */
    #at(event) {
        const { width, height } = this.#stage;
        const shown = this.#stage.getBoundingClientRect();
        const scale = Math.min(shown.width / width, shown.height / height);
        const x = (event.clientX - shown.left - (shown.width - width * scale) / 2) / scale;
        const y = (event.clientY - shown.top - (shown.height - height * scale) / 2) / scale;
        return [Math.min(Math.max(x, 0), width), Math.min(Math.max(y, 0), height)];
    }

    /** @param {PointerEvent} event */
    #begin(event) {
        if (!this.enabled || event.button !== 0) return;
        this.#stage.setPointerCapture(event.pointerId);
        this.#from = this.#at(event);
    }

    /** @param {PointerEvent} event */
    #move(event) {
        if (!this.enabled || !this.#from) return;
        const [[x1, y1], [x2, y2]] = [this.#from, this.#at(event)];
        const box = [Math.min(x1, x2), Math.min(y1, y2), Math.abs(x2 - x1), Math.abs(y2 - y1)].map(
            Math.round,
        );
        if (Math.min(box[2] ?? 0, box[3] ?? 0) >= LEAST) this.#set(box);
    }

    /** @param {KeyboardEvent} event */
    #key(event) {
        const arrow = ARROWS[event.key];
        if (!arrow || !this.enabled || !this.box) return;
        event.preventDefault();
        const { x, y, w, h } = this.box;
        const [right, down] = arrow.map((step) => step * (event.ctrlKey ? 10 : 1));
        if (event.shiftKey) this.#set([x, y, Math.max(w + right, LEAST), Math.max(h + down, LEAST)]);
        else this.#set([x + right, y + down, w, h]);
    }
}
