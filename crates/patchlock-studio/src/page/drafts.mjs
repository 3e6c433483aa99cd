// A box that is drawn or moved with keys, until it is accepted.

import * as edits from './edits.mjs';
import { describe } from './notices.mjs';
import { tidy } from './tracks.mjs';

/** @typedef {import('./editor.mjs').Editor} Editor */

/**
 * Begins a new box with keys, in the middle of the frame.
 * @param {Editor} editor
 */
export function beginNewBox(editor) {
    const { clip } = editor;
    if (!clip) return;
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
    const track = editor.needTarget();
    const box = track?.at(editor.frame).box ?? track?.nearestBox(editor.frame);
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
    const box = { ...editor.draft.box };
    if (!resize) box[axis] += by;
    else if (axis === 'x') box.w = Math.max(1, box.w + by);
    else box.h = Math.max(1, box.h + by);
    editor.draft = { ...editor.draft, box };
    const { x, y, w, h } = tidy(box);
    describe(`Box at ${x}, ${y}, ${w} by ${h}`);
    editor.changed();
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
    const another = fresh || (target === null && (await edits.isOfAnother(editor)));
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
