// Where the frame lies on the canvas: scale and shift, with zoom around a point.

/** @typedef {import('./types').Box} Box */

const LARGEST = 40;

export class Zoom {
    constructor() {
        this.scale = 1;
        this.x = 0;
        this.y = 0;
        /** The whole frame stays in view when the canvas changes its size. */
        this.fits = true;
        this.view = { width: 1, height: 1 };
        this.frame = { width: 1, height: 1 };
    }

    /**
     * @param {{width: number, height: number}} view size of the canvas in CSS pixels
     * @param {{width: number, height: number}} frame size of the frame
     */
    resize(view, frame) {
        const before = this.toFrame(this.view.width / 2, this.view.height / 2);
        this.view = view;
        this.frame = frame;
        if (this.fits) this.fit();
        else this.centre(before.x, before.y);
    }

    get fitScale() {
        const { view, frame } = this;
        const margin = 8;
        return Math.max(
            0.01,
            Math.min((view.width - 2 * margin) / frame.width, (view.height - 2 * margin) / frame.height),
        );
    }

    fit() {
        this.fits = true;
        this.scale = this.fitScale;
        this.centre(this.frame.width / 2, this.frame.height / 2);
        this.fits = true;
    }

    /** One pixel of the frame is one of the screen. */
    actual() {
        this.around(1 / devicePixelRatio / this.scale, this.view.width / 2, this.view.height / 2);
    }

    /**
     * A part of the frame fills much of the canvas.
     * @param {Box} box
     */
    show(box) {
        const wanted = Math.min(this.view.width / box.w, this.view.height / box.h) / 3;
        this.scale = this.#within(wanted);
        this.fits = false;
        this.centre(box.x + box.w / 2, box.y + box.h / 2);
    }

    /**
     * Shows a point of the frame in the middle, at this scale.
     * @param {number} scale
     * @param {number} x
     * @param {number} y
     */
    at(scale, x, y) {
        this.scale = Math.min(LARGEST, scale);
        this.fits = false;
        this.centre(x, y);
    }

    /**
     * Puts a point of the frame in the middle.
     * @param {number} x
     * @param {number} y
     */
    centre(x, y) {
        this.x = this.view.width / 2 - x * this.scale;
        this.y = this.view.height / 2 - y * this.scale;
    }

    /** @param {number} scale */
    #within(scale) {
        return Math.min(LARGEST, Math.max(this.fitScale / 2, scale));
    }

    /**
     * Zooms around a point of the canvas.
     * @param {number} factor
     * @param {number} x
     * @param {number} y
     */
    around(factor, x, y) {
        const scale = this.#within(this.scale * factor);
        const by = scale / this.scale;
        this.x = x - (x - this.x) * by;
        this.y = y - (y - this.y) * by;
        this.scale = scale;
        this.fits = false;
        this.#keepInView();
    }

    /**
     * @param {number} dx
     * @param {number} dy
     */
    pan(dx, dy) {
        this.x += dx;
        this.y += dy;
        this.fits = false;
        this.#keepInView();
    }

    /** Some of the frame stays visible. */
    #keepInView() {
        const edge = 60;
        const { view, frame, scale } = this;
        this.x = Math.min(view.width - edge, Math.max(edge - frame.width * scale, this.x));
        this.y = Math.min(view.height - edge, Math.max(edge - frame.height * scale, this.y));
    }

    /**
     * @param {number} x
     * @param {number} y
     */
    toFrame(x, y) {
        return { x: (x - this.x) / this.scale, y: (y - this.y) / this.scale };
    }

    /**
     * @param {Box} box in the frame
     * @returns {Box} on the canvas
     */
    toView({ x, y, w, h, outline }) {
        const { scale } = this;
        const box = { x: x * scale + this.x, y: y * scale + this.y, w: w * scale, h: h * scale };
        if (!outline) return box;
        return { ...box, outline: outline.map(([u, v]) => [u * scale + this.x, v * scale + this.y]) };
    }
}
