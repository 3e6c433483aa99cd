// A box that is drawn or moved with keys, until it is accepted.

import * as edits from './edits.mjs';
import { describe, tell } from './notices.mjs';
import { boxAround, moved, resized, sizeOf, turned } from './outline.mjs';
import { overlap, tidy } from './tracks.mjs';

/** @typedef {import('./editor.mjs').Editor} Editor */

/** An outline that overlaps the box of the selected target by this share is that of the target. */
const SAME = 0.5;

/**
 * Begins a new box with keys, in the middle of the frame.
 * @param {Editor} editor
 */
export function beginNewBox(editor) {
    const { clip } = editor;
    if (!clip) return;
    editor.hold();
    editor.polygon = null;
    editor.drawing = true;
    const { width, height } = clip.project.video;
    const [w, h] = [width / 6, height / 6];
    editor.draft = { target: null, box: { x: (width - w) / 2, y: (height - h) / 2, w, h } };
    editor.changed();
}

/**
 * Edits the box of the selected target with keys.
 * @param {Editor} editor
 */
export function beginEdit(editor) {
    editor.hold();
    editor.polygon = null;
    const track = editor.needTarget();
    const box = track && (editor.boxOf(track, editor.frame) ?? track.nearestBox(editor.frame));
    if (!track || !box) return;
    editor.draft = { target: track.target.id, box };
    editor.changed();
}

/**
 * Moves or resizes the box that is edited.
 * @param {Editor} editor
 * @param {'x' | 'y'} axis
 * @param {number} by pixels
 * @param {boolean} resize
 */
export function nudge(editor, axis, by, resize) {
    if (!editor.draft) return;
    const { box: before } = editor.draft;
    const [dx, dy] = axis === 'x' ? [by, 0] : [0, by];
    const isLeast = resize && (axis === 'x' ? before.w : before.h) + by < 1;
    if (isLeast) return;
    const box = resize ? resized(before, 'se', dx, dy) : moved(before, dx, dy);
    editor.draft = { ...editor.draft, box };
    const { x, y, w, h } = tidy(box);
    describe(`Box at ${x}, ${y}, ${w} by ${h}`);
    editor.changed();
}

/**
 * Turns the box that is edited, or begins to edit that of the selected target.
 * @param {Editor} editor
 * @param {number} degrees clockwise
 */
export function turn(editor, degrees) {
    if (editor.polygon) return;
    if (!editor.draft) beginEdit(editor);
    if (!editor.draft) return;
    editor.draft = { ...editor.draft, box: turned(editor.draft.box, degrees) };
    describe(sizeOf(editor.draft.box));
    editor.changed();
}

/**
 * The next clicks are the points of a polygon.
 * @param {Editor} editor
 */
export function beginPolygon(editor) {
    if (!editor.clip) return;
    editor.hold();
    editor.cancelDraft();
    Object.assign(editor, { drawing: true, polygon: { points: [], fresh: false } });
    editor.changed();
}

/**
 * Removes the last point of the polygon that is drawn.
 * @param {Editor} editor
 */
export function removePoint(editor) {
    editor.polygon?.points.pop();
    editor.changed();
}

/**
 * The polygon that is drawn has all its points.
 * @param {Editor} editor
 */
export async function closePolygon(editor) {
    if (!editor.polygon) return;
    const { points, fresh } = editor.polygon;
    if (points.length < 3) return tell('A polygon has at least three points.');
    editor.cancelDraft();
    await acceptDrawn(editor, boxAround(points), fresh);
}

/**
 * Accepts a box that was drawn while a target may be selected.
 * @param {Editor} editor
 * @param {import('./types').Box} box
 * @param {boolean} fresh whether it was said to be that of another target
 */
export async function acceptDrawn(editor, box, fresh) {
    const target = fresh ? null : edits.targetOfNewBox(editor);
    editor.draft = { target, box };
    editor.changed();
    const seen = editor.track && editor.boxOf(editor.track, editor.frame);
    const isOwn = Boolean(box.outline && seen && overlap(seen, box) >= SAME);
    const another = fresh || (target === null && !isOwn && (await edits.isOfAnother(editor)));
    editor.cancelDraft();
    editor.changed();
    if (another === null) return;
    await (another ? edits.addTarget(editor, box) : edits.correct(editor, box));
}

/** @param {Editor} editor */
export async function acceptDraft(editor) {
    const { draft } = editor;
    editor.draft = null;
    editor.drawing = false;
    if (!draft) return;
    editor.changed();
    await (draft.target === null ? edits.addTarget(editor, draft.box) : edits.setKey(editor, draft.box));
}
