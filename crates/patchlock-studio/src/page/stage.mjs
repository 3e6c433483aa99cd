// The canvases: the frame, the boxes over it, and what pointers do there.

import * as drafts from './drafts.mjs';
import * as edits from './edits.mjs';
import * as proposals from './proposals.mjs';
import { byId } from './dom.mjs';
import { drawBox, drawCross, drawHidden, drawPolygon, handlesOf } from './drawing.mjs';
import { moved, resized, rotatedBox, sizeOf, turned } from './outline.mjs';
import { tidy } from './tracks.mjs';
import { Zoom } from './zoom.mjs';

/** @typedef {import('./types').Box} Box */
/** @typedef {import('./drawing.mjs').Handle} Handle */
/** @typedef {{x: number, y: number}} Point */
/**
 * What a pointer that is down does.
 * @typedef {{kind: 'draw', from: Point, target: number | null, fresh: boolean}
 *     | {kind: 'move', from: Point, box: Box, target: number}
 *     | {kind: 'resize', from: Point, box: Box, target: number, handle: Handle | number}
 *     | {kind: 'turn', from: Point, box: Box, target: number} | {kind: 'point', from: Point}
 *     | {kind: 'pan', last: Point} | {kind: 'pinch', last: Point, spread: number}} Gesture
 */

/** Pixels of the screen that a pointer may move in a click. */
const CLICK = 4;
/** Pixels of the screen that a pointer may be off what it takes hold of. */
const REACH = 9;
/** The angles at which a box snaps while it is turned with Shift, in degrees. */
const SNAP = 15;
/** The least side of a new box, in pixels of the screen: less is a slip of the hand. */
const SMALLEST = 6;

export class Stage {
    /** @param {import('./editor.mjs').Editor} editor */
    constructor(editor) {
        this.editor = editor;
        this.canvas = /** @type {HTMLCanvasElement} */ (byId('stage'));
        this.context = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext('2d'));
        /** The frame has a canvas of its own, so that the boxes keep their colours however it is shown. */
        this.picture = /** @type {HTMLCanvasElement} */ (byId('picture'));
        this.pictureContext = /** @type {CanvasRenderingContext2D} */ (this.picture.getContext('2d'));
        this.zoom = new Zoom();
        /** @type {Gesture | null} */
        this.gesture = null;
        this.moved = false;
        /** Pointers that are down: @type {Map<number, Point>} */
        this.pointers = new Map();
        /** Where the pointer is, without being down: @type {Point | null} */
        this.hover = null;
        new ResizeObserver(() => this.#resize()).observe(this.canvas);
        editor.addEventListener('opened', () => this.#newClip());
        this.#listen();
    }

    #listen() {
        const { canvas } = this;
        canvas.addEventListener('pointerdown', (event) => this.#down(event));
        canvas.addEventListener('pointermove', (event) => this.#move(event));
        canvas.addEventListener('pointerup', (event) => this.#up(event));
        canvas.addEventListener('pointercancel', (event) => this.#cancel(event));
        canvas.addEventListener('pointerleave', () => {
            this.hover = null;
            this.editor.changed();
        });
        canvas.addEventListener('contextmenu', (event) => event.preventDefault());
        canvas.addEventListener('wheel', (event) => this.#wheel(event), { passive: false });
        canvas.addEventListener('dblclick', () => {
            if (this.editor.polygon) void drafts.closePolygon(this.editor);
            else this.toggleZoom();
        });
    }

    #newClip() {
        this.gesture = null;
        this.pointers.clear();
        const { width = 1, height = 1 } = this.editor.clip?.info ?? {};
        this.zoom.resize(this.zoom.view, { width, height });
        this.zoom.fit();
        this.#zoomed();
    }

    #resize() {
        const { clientWidth: width, clientHeight: height } = this.canvas;
        for (const canvas of [this.canvas, this.picture]) {
            canvas.width = Math.round(width * devicePixelRatio);
            canvas.height = Math.round(height * devicePixelRatio);
        }
        this.zoom.resize({ width, height }, this.zoom.frame);
        this.#zoomed();
        // Without this the canvas would be empty until the next change.
        this.render();
    }

    /** Frames are asked for in the width in which they are seen. */
    #zoomed() {
        this.editor.setWidth(this.zoom.frame.width * this.zoom.scale * devicePixelRatio);
        byId('zoom-tools').hidden = !this.editor.clip;
        byId('zoom').textContent = `${Math.round(100 * this.zoom.scale * devicePixelRatio)} %`;
        this.editor.changed();
    }

    // Zoom

    /** What is in view, to show it again: null if that is the whole frame. */
    get place() {
        const { view, scale, fits } = this.zoom;
        return fits ? null : { scale, ...this.zoom.toFrame(view.width / 2, view.height / 2) };
    }

    /** @param {{scale: number, x: number, y: number}} place */
    showPlace({ scale, x, y }) {
        this.zoom.at(scale, x, y);
        this.#zoomed();
    }

    fit() {
        this.zoom.fit();
        this.#zoomed();
    }

    actual() {
        this.zoom.actual();
        this.#zoomed();
    }

    /** @param {number} factor */
    zoomBy(factor) {
        const { width, height } = this.zoom.view;
        this.zoom.around(factor, this.hover?.x ?? width / 2, this.hover?.y ?? height / 2);
        this.#zoomed();
    }

    /** The selected target large, or the whole frame. */
    toggleZoom() {
        const box = this.editor.track?.at(this.editor.frame).box;
        if (!this.zoom.fits || !box) return this.fit();
        this.zoom.show(box);
        this.#zoomed();
    }

    /** @param {WheelEvent} event */
    #wheel(event) {
        event.preventDefault();
        const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
        const { x, y } = this.#point(event);
        if (event.shiftKey) this.zoom.pan(-lines * (event.deltaX || event.deltaY), 0);
        // Browsers report a pinch on a touchpad as a wheel with Ctrl, in smaller steps.
        else this.zoom.around(Math.exp(-lines * event.deltaY * (event.ctrlKey ? 0.01 : 0.0016)), x, y);
        this.#zoomed();
    }

    // Pointers

    /** @param {MouseEvent} event @returns {Point} */
    #point(event) {
        const { left, top } = this.canvas.getBoundingClientRect();
        return { x: event.clientX - left, y: event.clientY - top };
    }

    /** @param {PointerEvent} event */
    #down(event) {
        this.canvas.focus({ preventScroll: true });
        this.canvas.setPointerCapture(event.pointerId);
        const at = this.#point(event);
        this.pointers.set(event.pointerId, at);
        this.moved = false;
        if (this.pointers.size === 2) this.#beginPinch();
        else if (event.button === 1 || event.button === 2) this.gesture = { kind: 'pan', last: at };
        else if (event.button === 0 && this.editor.clip) this.gesture = this.#begin(at, event);
        event.preventDefault();
        this.editor.changed();
    }

    /**
     * @param {Point} at
     * @param {PointerEvent} event
     * @returns {Gesture}
     */
    #begin(at, event) {
        const { editor } = this;
        // A drag belongs to the picture that is seen; what a key began, to the frame that is on its way.
        editor.hold(!editor.drawing);
        const from = this.zoom.toFrame(at.x, at.y);
        if (editor.polygon) return { kind: 'point', from };
        const reach = event.pointerType === 'touch' ? 22 : REACH;
        const fresh = event.shiftKey || editor.drawing;
        const found = editor.drawing ? null : this.#handle(at, reach);
        // Shift also snaps the angle, and may be down before the pointer.
        if (found?.handle === 'turn') return { kind: 'turn', from, box: found.box, target: found.target };
        if (found && !fresh) return { kind: 'resize', from, ...found, handle: found.handle };
        const hit = fresh ? null : this.#hit(from);
        if (hit) edits.choose(editor, hit.target);
        if (hit && !this.#isLost) return { kind: 'move', from, ...hit };
        return { kind: 'draw', from, fresh, target: fresh ? null : edits.targetOfNewBox(editor) };
    }

    /**
     * Whether the selected target is lost. Its box is only where it was last seen: a drag on it draws the new
     * one, which often begins at the same corner.
     */
    get #isLost() {
        const { editor } = this;
        const { draft, track, shownFrame } = editor;
        if (draft || !track || editor.pending(track.target.id, shownFrame)) return false;
        return track.at(shownFrame).kind === 'lost';
    }

    /**
     * The handle of the selected box near a point of the canvas.
     * @param {Point} at
     * @param {number} reach
     */
    #handle(at, reach) {
        const { editor } = this;
        const box = editor.draft?.box ?? (editor.track && editor.boxOf(editor.track, editor.shownFrame));
        const target = editor.draft?.target ?? editor.selected;
        if (!box || target === null || editor.unseen.has(target) || this.#isLost) return null;
        const handles = handlesOf(this.zoom.toView(box));
        const near = handles.find(({ x, y }) => Math.hypot(x - at.x, y - at.y) <= reach);
        return near ? { handle: near.handle, box, target } : null;
    }

    /**
     * The box at a point of the frame: the selected one, otherwise the smallest.
     * @param {Point} at
     */
    #hit(at) {
        const { editor } = this;
        const found = (editor.clip?.tracks ?? []).flatMap((track) => {
            const box = editor.boxOf(track, editor.shownFrame);
            const target = track.target.id;
            if (!box || editor.unseen.has(target)) return [];
            const inside = at.x >= box.x && at.y >= box.y && at.x <= box.x + box.w && at.y <= box.y + box.h;
            return inside ? [{ target, box }] : [];
        });
        const selected = found.find(({ target }) => target === editor.selected);
        return selected ?? found.sort((a, b) => a.box.w * a.box.h - b.box.w * b.box.h)[0] ?? null;
    }

    #beginPinch() {
        this.editor.cancelDraft();
        const { last, spread } = this.#pinch();
        this.gesture = { kind: 'pinch', last, spread };
    }

    /** Middle and distance of two fingers. */
    #pinch() {
        const [a = { x: 0, y: 0 }, b = a] = [...this.pointers.values()];
        return { last: { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 }, spread: Math.hypot(a.x - b.x, a.y - b.y) };
    }

    /** @param {PointerEvent} event */
    #move(event) {
        const at = this.#point(event);
        this.hover = at;
        const { gesture } = this;
        const before = this.pointers.get(event.pointerId);
        if (before && gesture) {
            if (!this.moved && !this.#hasMoved(gesture, at)) return;
            this.moved = true;
            this.pointers.set(event.pointerId, at);
            this.#follow(gesture, at, event.shiftKey);
        }
        this.canvas.style.cursor = this.#cursor(at);
        this.editor.changed();
    }

    /**
     * @param {Gesture} gesture
     * @param {Point} at
     */
    #hasMoved(gesture, at) {
        if (gesture.kind === 'pan' || gesture.kind === 'pinch') return true;
        const { x, y } = this.zoom.toView({ ...gesture.from, w: 0, h: 0 });
        return Math.hypot(at.x - x, at.y - y) >= CLICK;
    }

    /**
     * @param {Gesture} gesture
     * @param {Point} at
     * @param {boolean} snap whether a box that is turned snaps at certain angles
     */
    #follow(gesture, at, snap) {
        const { zoom, editor } = this;
        if (gesture.kind === 'pan') {
            zoom.pan(at.x - gesture.last.x, at.y - gesture.last.y);
            gesture.last = at;
            return;
        }
        if (gesture.kind === 'pinch') return this.#followPinch(gesture);
        const now = zoom.toFrame(at.x, at.y);
        const [dx, dy] = [now.x - gesture.from.x, now.y - gesture.from.y];
        if (gesture.kind === 'draw') {
            const inside = this.#inFrame(now);
            const from = this.#inFrame(gesture.from);
            const box = tidy({ ...from, w: inside.x - from.x, h: inside.y - from.y });
            editor.draft = { target: gesture.target, box };
        } else if (gesture.kind === 'move') {
            editor.draft = { target: gesture.target, box: moved(gesture.box, dx, dy) };
        } else if (gesture.kind === 'turn') {
            editor.draft = { target: gesture.target, box: afterTurn(gesture, now, snap) };
        } else if (gesture.kind === 'resize') {
            const box = tidy(resized(gesture.box, gesture.handle, dx, dy));
            editor.draft = { target: gesture.target, box };
        }
    }

    /** @param {Extract<Gesture, {kind: 'pinch'}>} gesture */
    #followPinch(gesture) {
        const { last, spread } = this.#pinch();
        this.zoom.pan(last.x - gesture.last.x, last.y - gesture.last.y);
        if (gesture.spread > 0) this.zoom.around(spread / gesture.spread, last.x, last.y);
        Object.assign(gesture, { last, spread });
        this.#zoomed();
    }

    /** @param {Point} point */
    #inFrame({ x, y }) {
        const { width, height } = this.zoom.frame;
        return { x: Math.min(width, Math.max(0, x)), y: Math.min(height, Math.max(0, y)) };
    }

    /** @param {PointerEvent} event */
    #up(event) {
        const { gesture, editor, moved } = this;
        this.pointers.delete(event.pointerId);
        if (gesture?.kind === 'pinch' || gesture?.kind === 'pan') {
            this.gesture = this.pointers.size === 0 ? null : gesture;
            return;
        }
        this.gesture = null;
        if (!gesture) return;
        if (gesture.kind === 'point') return this.#addPoint(this.#point(event), event.shiftKey);
        if (!moved) {
            if (gesture.kind === 'draw' && !editor.drawing) this.#click(gesture.from);
            return;
        }
        this.#accept(gesture);
    }

    /**
     * Adds a point to the polygon that is drawn, or closes it at its first one. The second click of a double
     * click adds none.
     * @param {Point} at
     * @param {boolean} fresh whether it is that of another target
     */
    #addPoint(at, fresh) {
        const { editor, zoom } = this;
        const { polygon } = editor;
        if (!polygon) return;
        polygon.fresh ||= fresh;
        const isNear = (/** @type {import('./types').Point | undefined} */ point) => {
            if (!point) return false;
            const { x, y } = zoom.toView({ x: point[0], y: point[1], w: 0, h: 0 });
            return Math.hypot(x - at.x, y - at.y) <= REACH;
        };
        if (polygon.points.length > 2 && isNear(polygon.points[0])) return void drafts.closePolygon(editor);
        const { x, y } = this.#inFrame(zoom.toFrame(at.x, at.y));
        if (!isNear(polygon.points.at(-1))) polygon.points.push([x, y]);
        editor.changed();
    }

    /**
     * A click that moves no box: it accepts a proposal, or selects nothing where there is no box.
     * @param {Point} at
     */
    #click(at) {
        const proposal = proposals.proposalAt(this.editor, at);
        if (proposal) void proposals.accept(this.editor, [proposal]);
        else if (!this.#hit(at)) this.editor.select(null);
    }

    /** @param {Gesture} gesture */
    #accept(gesture) {
        const { editor } = this;
        const box = editor.draft?.box;
        if (!box) return;
        if (gesture.kind === 'draw' && Math.min(box.w, box.h) * this.zoom.scale < SMALLEST) {
            editor.cancelDraft();
            editor.changed();
            return;
        }
        // The box belongs to the picture that was on the screen.
        if (editor.frame !== editor.shownFrame) editor.goTo(editor.shownFrame);
        if (gesture.kind === 'draw') return void drafts.acceptDrawn(editor, box, gesture.fresh);
        editor.draft = { target: editor.selected, box };
        void drafts.acceptDraft(editor);
    }

    /** @param {PointerEvent} event */
    #cancel(event) {
        this.pointers.delete(event.pointerId);
        this.gesture = null;
        this.editor.cancelDraft();
        this.editor.changed();
    }

    /** @param {Point} at */
    #cursor(at) {
        const { gesture, editor } = this;
        if (gesture?.kind === 'pan') return 'grabbing';
        if (gesture?.kind === 'move') return 'move';
        if (editor.drawing) return 'crosshair';
        const held = gesture?.kind === 'turn' ? 'turn' : gesture?.kind === 'resize' ? gesture.handle : null;
        const handle = held ?? this.#handle(at, REACH)?.handle;
        if (handle === 'turn') return held ? 'grabbing' : 'grab';
        if (handle !== undefined) return typeof handle === 'number' ? 'move' : `${handle}-resize`;
        const point = this.zoom.toFrame(at.x, at.y);
        const hit = this.#hit(point);
        if (editor.joinFirst !== null && hit) return 'copy';
        if (!hit && !gesture && proposals.proposalAt(editor, point)) return 'pointer';
        if (!hit || (hit.target === editor.selected && this.#isLost)) return 'crosshair';
        return hit.target === editor.selected ? 'move' : 'pointer';
    }

    // Drawing

    render() {
        const { context, zoom, editor, canvas } = this;
        for (const each of [context, this.pictureContext]) {
            each.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
            each.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);
        }
        this.#renderPicture();
        if (!editor.clip) return;
        for (const track of editor.clip.tracks) {
            if (track.target.id !== editor.selected) this.#renderTrack(track);
        }
        if (editor.track) this.#renderTrack(editor.track);
        this.#renderProposals();
        this.#renderNew();
        this.#renderPolygon();
        if (editor.drawing && !this.gesture && this.hover) drawCross(context, this.hover, zoom.view);
    }

    #renderPolygon() {
        const { polygon, label, clip } = this.editor;
        if (!polygon) return;
        const points = polygon.points.map(([x, y]) => this.zoom.toView({ x, y, w: 0, h: 0 }));
        const colour = clip?.colourOfLabel(label ?? '') ?? '#888888';
        drawPolygon(this.context, this.hover ? [...points, this.hover] : points, colour);
    }

    #renderPicture() {
        const { pictureContext: context, zoom, editor } = this;
        const picture = editor.frames?.shown?.picture;
        // For tests: which frame is on the screen, and how much tracking has ended.
        this.canvas.dataset.frame = picture ? String(editor.shownFrame) : '';
        this.canvas.dataset.jobs = String(editor.clip?.ended ?? 0);
        const { x, y, w, h } = zoom.toView({ x: 0, y: 0, w: zoom.frame.width, h: zoom.frame.height });
        if (!picture) return;
        // Large pixels are seen as they are.
        context.imageSmoothingEnabled = zoom.scale * devicePixelRatio < 4;
        context.imageSmoothingQuality = 'high';
        context.drawImage(picture, x, y, w, h);
    }

    /** @param {import('./tracks.mjs').Track} track */
    #renderTrack(track) {
        const { editor, context, zoom } = this;
        const { id, label } = track.target;
        const frame = editor.shownFrame;
        if (editor.unseen.has(id)) return;
        const seen = track.at(frame);
        const edited = this.#edited(id, frame);
        const box = edited ?? seen.box;
        if (!box) return;
        const selected = id === editor.selected;
        const shown = zoom.toView(box);
        const { look } = editor;
        if (selected && editor.looking && look?.box && frame === editor.frame && !edited) {
            const finest = look.scales.at(-1);
            if (finest) drawHidden(context, zoom.toView(look.box), finest);
        }
        const kind = edited ? 'key' : seen.kind;
        const score = kind === 'key' || seen.score === null ? '' : ` ${seen.score.toFixed(2)}`;
        const word = kind === 'lost' ? ' LOST' : `${score}${kind === 'uncertain' ? ' uncertain' : ''}`;
        const flags = `${seen.occluded ? ' · occluded' : ''}${seen.truncated ? ' · truncated' : ''}`;
        const size = edited ? ` ${sizeOf(box)}` : '';
        const colour = editor.clip?.colour(id) ?? '#888888';
        const text = `${label} ${id}${edited ? size : word}${flags}`;
        const handles = selected && !editor.playing && kind !== 'lost';
        drawBox(context, shown, { colour, text, selected, kind, handles });
    }

    /**
     * The box that is dragged, or on its way to the server.
     * @param {number} id
     * @param {number} frame
     */
    #edited(id, frame) {
        const { draft } = this.editor;
        return draft?.target === id ? draft.box : this.editor.pending(id, frame);
    }

    #renderProposals() {
        const { editor, context, zoom } = this;
        for (const proposal of editor.proposals.in(editor.clip, editor.shownFrame)) {
            const colour = editor.clip?.colourOfLabel(proposal.label) ?? '#888888';
            const text = proposals.nameOf(proposal);
            const selected = proposal === editor.proposal;
            drawBox(context, zoom.toView(proposal.box), { colour, text, selected, kind: 'proposal' });
        }
    }

    #renderNew() {
        const { editor, context, zoom } = this;
        const { draft, pendingBox } = editor;
        const pending =
            pendingBox?.target === null && pendingBox.frame === editor.shownFrame ? pendingBox : null;
        const box = draft && draft.target === null ? draft.box : pending?.box;
        if (!box) return;
        const label = editor.label ?? 'object';
        const text = `${label} ${sizeOf(box)}`;
        const colour = editor.clip?.colourOfLabel(label) ?? '#888888';
        drawBox(context, zoom.toView(box), {
            colour,
            text,
            selected: true,
            kind: 'key',
            handles: Boolean(draft),
        });
    }
}

/**
 * The box that a person turns, with the pointer here.
 * @param {{from: Point, box: Box}} gesture
 * @param {Point} now
 * @param {boolean} snap
 */
function afterTurn({ from, box }, now, snap) {
    const [x, y] = [box.x + box.w / 2, box.y + box.h / 2];
    const angle = (/** @type {Point} */ at) => (Math.atan2(at.y - y, at.x - x) * 180) / Math.PI;
    const by = angle(now) - angle(from);
    const before = rotatedBox(box)?.degrees ?? 0;
    return turned(box, snap ? Math.round((before + by) / SNAP) * SNAP - before : by);
}
