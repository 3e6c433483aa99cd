// A row for each target: its score and status by frame, key frames, hidden stretches, doubtful places. In the
// ruler above, a square for each frame in which proposals wait.

import * as edits from './edits.mjs';
import * as stretches from './stretches.mjs';
import { byId, counted, element } from './dom.mjs';
import { drawDiamond } from './drawing.mjs';
import { ordered } from './tracks.mjs';

/** @typedef {import('./tracks.mjs').Track} Track */

const ROW = 26;
const RULER = 22;
/** Pixels from a key frame, or from the square of proposals, at which a click means it. */
const SNAP = 5;
/** Pixels left and right of the frames, so that marks at the ends are whole. */
const MARGIN = 8;
const FEWEST = 10;

export class Timeline {
    /** @param {import('./editor.mjs').Editor} editor */
    constructor(editor) {
        this.editor = editor;
        this.scroller = byId('timeline-scroller');
        this.names = byId('timeline-names');
        this.area = byId('timeline-area');
        this.ruler = /** @type {HTMLCanvasElement} */ (byId('timeline-ruler'));
        this.rows = /** @type {HTMLCanvasElement} */ (byId('timeline-rows'));
        this.playhead = byId('playhead');
        this.from = 0;
        this.to = 1;
        this.drawn = '';
        /** The proposals that are drawn: @type {import('./proposals.mjs').Proposal[]} */
        this.waiting = [];
        this.named = '';
        /** Where the stretch begins that is being marked: @type {number | null} */
        this.marking = null;
        new ResizeObserver(() => this.#invalidate()).observe(this.area);
        matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.#invalidate());
        editor.addEventListener('opened', () => this.fit());
        this.#listen();
    }

    #listen() {
        const drag = (/** @type {PointerEvent} */ event) => {
            if (!(event.buttons & 1)) return;
            if (this.marking === null) this.#scrub(event, false);
            else stretches.markStretch(this.editor, this.marking, this.#frameAt(event));
        };
        for (const canvas of [this.ruler, this.rows]) {
            canvas.addEventListener('pointerdown', (event) => {
                if (event.button !== 0) return;
                canvas.setPointerCapture(event.pointerId);
                if (!this.#beginMarking(event)) this.#scrub(event, true);
            });
            canvas.addEventListener('pointermove', drag);
        }
        this.area.addEventListener('wheel', (event) => this.#wheel(event), { passive: false });
        byId('timeline-in').addEventListener('click', () => this.#zoom(1 / 1.6));
        byId('timeline-out').addEventListener('click', () => this.#zoom(1.6));
        byId('timeline-fit').addEventListener('click', () => this.fit());
        byId('timeline-slider').addEventListener('focus', () => this.render());
    }

    #invalidate() {
        this.drawn = '';
        this.render();
    }

    fit() {
        this.from = 0;
        this.to = Math.max(1, this.editor.clip?.info.frames ?? 1);
        this.#invalidate();
    }

    get width() {
        return this.area.clientWidth;
    }

    /** Pixels from the first frame to the last. */
    get #length() {
        return Math.max(1, this.width - 2 * MARGIN);
    }

    /** @param {number} frame */
    #x(frame) {
        return MARGIN + ((frame + 0.5 - this.from) / (this.to - this.from)) * this.#length;
    }

    /** @param {number} x */
    #frame(x) {
        const frame = Math.floor(this.from + ((x - MARGIN) / this.#length) * (this.to - this.from));
        return Math.min(Math.max(0, frame), this.editor.count - 1);
    }

    /** @param {MouseEvent} event */
    #xOf(event) {
        return event.clientX - this.area.getBoundingClientRect().left;
    }

    /** @param {MouseEvent} event */
    #frameAt(event) {
        return this.#frame(this.#xOf(event));
    }

    /** @param {MouseEvent} event */
    #trackAt(event) {
        const isRow = event.currentTarget === this.rows;
        return isRow ? this.editor.clip?.tracks[Math.floor(event.offsetY / ROW)] : undefined;
    }

    /**
     * With Shift a drag in the row of a target marks a stretch.
     * @param {PointerEvent} event
     */
    #beginMarking(event) {
        const track = event.shiftKey ? this.#trackAt(event) : undefined;
        this.marking = track ? this.#frameAt(event) : null;
        if (!track) return false;
        this.editor.select(track.target.id);
        this.editor.goTo(this.#frameAt(event));
        return true;
    }

    /**
     * @param {PointerEvent} event
     * @param {boolean} pressed
     */
    #scrub(event, pressed) {
        const { editor } = this;
        const x = this.#xOf(event);
        const frame = this.#frame(x);
        const track = this.#trackAt(event);
        if (pressed && track) {
            const joins = editor.joinFirst !== null;
            edits.choose(editor, track.target.id);
            if (joins) return;
        }
        const onRuler = event.currentTarget === this.ruler;
        const marks = track?.keys ?? (onRuler ? this.waiting.map((each) => each.frame) : []);
        const mark = pressed ? marks.find((at) => Math.abs(this.#x(at) - x) <= SNAP) : undefined;
        editor.goTo(mark ?? frame);
    }

    /** @param {WheelEvent} event */
    #wheel(event) {
        const sideways = event.shiftKey ? event.deltaX || event.deltaY : event.deltaX;
        if (event.ctrlKey || event.metaKey) {
            this.#zoom(Math.exp(event.deltaY * 0.004), this.#xOf(event));
        } else if (sideways) {
            this.#shift((sideways / this.#length) * (this.to - this.from));
        } else return;
        event.preventDefault();
    }

    /**
     * @param {number} factor
     * @param {number} [x] what stays in its place; the playhead, if not given
     */
    #zoom(factor, x = this.#x(this.editor.frame)) {
        const { count } = this.editor;
        const length = Math.min(count, Math.max(Math.min(FEWEST, count), (this.to - this.from) * factor));
        const share = Math.min(1, Math.max(0, (x - MARGIN) / this.#length));
        const still = this.from + share * (this.to - this.from);
        this.from = still - share * length;
        this.to = this.from + length;
        this.#shift(0);
    }

    /** @param {number} by */
    #shift(by) {
        const length = this.to - this.from;
        this.from = Math.min(Math.max(0, this.from + by), Math.max(0, this.editor.count - length));
        this.to = this.from + length;
        this.#invalidate();
    }

    #followPlayhead() {
        const { frame, count } = this.editor;
        const length = this.to - this.from;
        if (length >= count || (frame >= this.from && frame < this.to)) return;
        this.from = Math.min(Math.max(0, frame - length / 4), count - length);
        this.to = this.from + length;
    }

    render() {
        const { editor } = this;
        this.#followPlayhead();
        this.#renderNames();
        const tracks = editor.clip?.tracks ?? [];
        const live = tracks.reduce((sum, track) => sum + track.live.size, 0);
        const state = JSON.stringify([
            editor.clip?.info.id,
            editor.clip?.revision,
            live,
            this.from,
            this.to,
            this.width,
            devicePixelRatio,
            editor.selected,
            this.#marked(),
            editor.clip?.doubts.map(({ target, frame }) => [target, frame]),
            tracks.length,
        ]);
        const waiting = editor.proposals.of(editor.clip);
        if ((state !== this.drawn || waiting !== this.waiting) && this.width > 0) {
            this.drawn = state;
            this.waiting = waiting;
            this.#renderRuler();
            this.#renderRows(tracks);
        }
        this.playhead.style.transform = `translateX(${this.#x(editor.frame)}px)`;
        this.#renderSlider();
    }

    /** The frames of the selected target that are marked, or being marked, or going to be hidden. */
    #marked() {
        const { stretch, markFrom, hiddenFrom, frame } = this.editor;
        if (stretch) return stretch;
        const begin = markFrom ?? hiddenFrom;
        return begin === null ? null : ordered(begin, frame);
    }

    #renderSlider() {
        const { editor } = this;
        const slider = byId('timeline-slider');
        slider.setAttribute('aria-valuemax', String(Math.max(0, editor.count - 1)));
        slider.setAttribute('aria-valuenow', String(editor.frame));
        const here = editor.proposals.in(editor.clip, editor.frame).length;
        const proposals = here ? `, ${counted(here, 'proposal')}` : '';
        slider.setAttribute('aria-valuetext', `Frame ${editor.frame}${proposals}`);
    }

    #renderNames() {
        const { editor } = this;
        const { clip } = editor;
        const targets = clip?.project.targets ?? [];
        const state = JSON.stringify([
            targets.map(({ id, label }) => [id, label, clip?.colour(id)]),
            editor.selected,
        ]);
        if (state === this.named) return;
        this.named = state;
        this.names.replaceChildren(
            ...targets.map(({ id, label }) => {
                const swatch = element('span', { class: 'swatch' });
                swatch.style.background = clip?.colour(id) ?? '';
                return element(
                    'button',
                    {
                        class: 'timeline-name',
                        attributes: {
                            type: 'button',
                            'aria-pressed': String(id === editor.selected),
                            title: `${label} ${id}`,
                        },
                        on: { click: () => edits.choose(editor, id) },
                    },
                    swatch,
                    element('span', { class: 'name', text: label }),
                    element('span', { class: 'id', text: String(id) }),
                );
            }),
        );
        byId('timeline-empty').hidden = targets.length > 0;
        this.names.querySelector('[aria-pressed=true]')?.scrollIntoView({ block: 'nearest' });
    }

    /**
     * @param {HTMLCanvasElement} canvas
     * @param {number} height
     */
    #prepare(canvas, height) {
        canvas.width = Math.round(this.width * devicePixelRatio);
        canvas.height = Math.round(height * devicePixelRatio);
        canvas.style.height = `${height}px`;
        const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
        context.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
        return context;
    }

    #renderRuler() {
        const context = this.#prepare(this.ruler, RULER);
        const paint = colours(this.area);
        const step = niceStep(((this.to - this.from) / this.#length) * 70);
        const minor = Math.max(1, step / 5);
        context.font = '11px Inter, system-ui, sans-serif';
        context.textBaseline = 'top';
        context.textAlign = 'center';
        context.fillStyle = paint('--faint');
        for (let frame = Math.ceil(this.from / minor) * minor; frame < this.to; frame += minor) {
            context.fillRect(Math.round(this.#x(frame)), RULER - 4, 1, 4);
        }
        context.fillStyle = paint('--muted');
        for (let frame = Math.ceil(this.from / step) * step; frame < this.to; frame += step) {
            const x = Math.round(this.#x(frame));
            context.fillRect(x, RULER - 7, 1, 7);
            const text = String(frame);
            const half = context.measureText(text).width / 2;
            context.fillText(text, Math.min(Math.max(half + 2, x), this.width - half - 2), 2);
        }
        this.#renderProposals(context, paint);
    }

    /**
     * @param {CanvasRenderingContext2D} context
     * @param {(name: string) => string} paint
     */
    #renderProposals(context, paint) {
        context.fillStyle = paint('--surface');
        context.strokeStyle = paint('--accent');
        context.lineWidth = 1.5;
        for (const frame of new Set(this.waiting.map((each) => each.frame))) {
            if (frame < this.from - 1 || frame > this.to + 1) continue;
            const left = Math.round(this.#x(frame)) - 3;
            context.fillRect(left, RULER - 8, 6, 6);
            context.strokeRect(left, RULER - 8, 6, 6);
        }
    }

    /** @param {Track[]} tracks */
    #renderRows(tracks) {
        const height = Math.max(1, tracks.length) * ROW;
        const context = this.#prepare(this.rows, height);
        const paint = colours(this.area);
        const hatch = hatching(context, paint('--hatch'));
        tracks.forEach((track, row) => {
            const top = row * ROW;
            if (track.target.id === this.editor.selected) {
                context.fillStyle = paint('--selected');
                context.fillRect(0, top, this.width, ROW);
            }
            context.fillStyle = paint('--line');
            context.fillRect(0, top + ROW - 1, this.width, 1);
            this.#renderStrip(context, track, top, paint, hatch);
            this.#renderMarks(context, track, top, paint);
        });
    }

    /**
     * The score by frame. Where several frames share a pixel, the worst of them is seen.
     * @param {CanvasRenderingContext2D} context
     * @param {Track} track
     * @param {number} top
     * @param {(name: string) => string} paint
     * @param {CanvasPattern | string} hatch
     */
    #renderStrip(context, track, top, paint, hatch) {
        const middle = top + ROW / 2;
        const perPixel = (this.to - this.from) / this.#length;
        const step = Math.max(1, perPixel);
        const end = Math.min(this.to, track.frames);
        for (let from = Math.max(0, Math.floor(this.from)); from < end; from += step) {
            const first = Math.floor(from);
            const next = Math.floor(from + step);
            const worst = track.worst(first, Math.min(next, track.frames));
            if (worst.kind === 'none') continue;
            const half = worst.kind === 'hidden' ? 5 : worst.kind === 'lost' ? 1.5 : 2 + 4 * worst.score;
            context.fillStyle = worst.kind === 'hidden' ? hatch : paint(scoreColour(worst));
            const left = Math.round(this.#x(first - 0.5));
            const right = Math.max(left + 1, Math.round(this.#x(next - 0.5)));
            context.fillRect(left, middle - half, right - left, 2 * half);
        }
    }

    /**
     * @param {CanvasRenderingContext2D} context
     * @param {Track} track
     * @param {number} top
     * @param {(name: string) => string} paint
     */
    #renderMarks(context, track, top, paint) {
        const { editor } = this;
        const middle = top + ROW / 2;
        const marked = this.#marked();
        if (marked && track.target.id === editor.selected) {
            const left = this.#x(marked.from - 0.5);
            const width = Math.max(3, this.#x(marked.to + 0.5) - left);
            context.strokeStyle = paint('--accent');
            context.lineWidth = 2;
            context.strokeRect(left, top + 3, width, ROW - 7);
        }
        context.fillStyle = paint('--warn');
        for (const { target, frame } of editor.clip?.doubts ?? []) {
            if (target !== track.target.id || frame < this.from || frame > this.to) continue;
            const x = this.#x(frame);
            context.beginPath();
            context.moveTo(x - 4, top + 1);
            context.lineTo(x + 4, top + 1);
            context.lineTo(x, top + 7);
            context.fill();
        }
        context.strokeStyle = paint('--surface');
        context.lineWidth = 1.5;
        context.fillStyle = paint('--key');
        for (const frame of track.keys) {
            if (frame < this.from - 1 || frame > this.to + 1) continue;
            drawDiamond(context, this.#x(frame), middle, 6);
            context.stroke();
        }
    }
}

/** @param {{kind: string, score: number}} worst */
function scoreColour({ kind, score }) {
    if (kind === 'lost') return '--score-lost';
    if (kind === 'key') return '--score-high';
    if (score < 0.35) return '--score-low';
    if (score < 0.6 || kind === 'uncertain') return '--score-middle';
    return score < 0.8 ? '--score-good' : '--score-high';
}

/**
 * Reads colours of the style sheet, each once.
 * @param {Element} from
 */
function colours(from) {
    const style = getComputedStyle(from);
    /** @type {Map<string, string>} */
    const read = new Map();
    return (/** @type {string} */ name) => {
        let value = read.get(name);
        if (value === undefined) read.set(name, (value = style.getPropertyValue(name).trim()));
        return value;
    };
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {string} colour
 */
function hatching(context, colour) {
    const tile = document.createElement('canvas');
    tile.width = tile.height = 6;
    const lines = tile.getContext('2d');
    if (!lines) return colour;
    lines.strokeStyle = colour;
    lines.lineWidth = 1.5;
    lines.beginPath();
    for (const shift of [-6, 0, 6]) {
        lines.moveTo(shift, 6);
        lines.lineTo(shift + 6, 0);
    }
    lines.stroke();
    return context.createPattern(tile, 'repeat') ?? colour;
}

/**
 * The next of 1, 2, 5, 10, 20, ...
 * @param {number} least
 */
function niceStep(least) {
    const power = 10 ** Math.floor(Math.log10(Math.max(1, least)));
    return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= least) ?? 10 * power;
}
