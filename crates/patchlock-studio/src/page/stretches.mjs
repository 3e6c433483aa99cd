// Stretches of frames of a target: not visible, or marked.

import { tell } from './notices.mjs';
import { ordered } from './tracks.mjs';

/** @typedef {import('./editor.mjs').Editor} Editor */

/**
 * Begins or ends the stretch in which the target is not visible.
 * @param {Editor} editor
 */
export async function markHidden(editor) {
    const track = editor.needTarget();
    if (!track) return;
    if (editor.hiddenFrom === null) {
        editor.markFrom = null;
        editor.hiddenFrom = editor.frame;
        editor.changed();
        return;
    }
    const { from, to } = ordered(editor.hiddenFrom, editor.frame);
    await hide(editor, from, to);
}

/**
 * @param {Editor} editor
 * @param {number} from
 * @param {number} to
 */
export async function hide(editor, from, to) {
    const track = editor.needTarget();
    if (!track) return;
    editor.hiddenFrom = null;
    editor.stretch = null;
    const made = await editor.clip?.edit([{ edit: 'hide', target: track.target.id, from, to }]);
    if (made) tell(`Target ${track.target.id} is not visible from frame ${from} to ${to}.`);
}

/**
 * In a hidden stretch: takes that back. Where the target is lost or doubtful, or nothing is known: hides that
 * whole stretch.
 * @param {Editor} editor
 */
export async function toggleStretch(editor) {
    const { frame } = editor;
    const track = await editor.settledTarget();
    if (!track) return;
    const stretch = track.hiddenAt(frame);
    if (!stretch) {
        const [from, to] = track.doubtfulAround(frame) ?? [];
        if (from === undefined || to === undefined)
            return tell('The target is neither hidden, lost nor doubtful here.');
        return hide(editor, from, to);
    }
    const [from, to] = stretch;
    await editor.clip?.edit([{ edit: 'show', target: track.target.id, from, to }]);
}

/**
 * Marks the frames between two of the selected target, and goes to the second.
 * @param {Editor} editor
 * @param {number} begin
 * @param {number} end
 */
export function markStretch(editor, begin, end) {
    editor.stretch = begin === end ? null : ordered(begin, end);
    editor.markFrom = null;
    editor.goTo(end);
}

/**
 * Begins to mark a stretch at this frame, or ends it here.
 * @param {Editor} editor
 */
export function toggleMark(editor) {
    if (!editor.needTarget()) return;
    if (editor.markFrom !== null) return markStretch(editor, editor.markFrom, editor.frame);
    editor.stretch = null;
    editor.hiddenFrom = null;
    editor.markFrom = editor.frame;
    editor.changed();
}

/**
 * Says that the target is not visible in the marked stretch.
 * @param {Editor} editor
 */
export async function hideStretch(editor) {
    if (editor.stretch) await hide(editor, editor.stretch.from, editor.stretch.to);
}

/**
 * Tracks the marked stretch again.
 * @param {Editor} editor
 */
export async function trackStretch(editor) {
    const { stretch } = editor;
    const track = stretch && (await editor.settledTarget());
    if (!track) return;
    const request = track.requestWithin(stretch.from, stretch.to);
    if (!request) return tell('There is no key frame to track these frames from. Draw a box there.');
    editor.stretch = null;
    await editor.clip?.startTracking(request);
}

/**
 * Removes the boxes of the marked stretch.
 * @param {Editor} editor
 */
export async function deleteBoxes(editor) {
    const { stretch, clip } = editor;
    const track = stretch && (await editor.settledTarget());
    if (!track || !clip) return;
    const { from, to } = stretch;
    if (track.keys.every((frame) => from <= frame && frame <= to)) {
        return tell('All key frames are in this stretch. Press Esc, then Del to delete the target.');
    }
    editor.stretch = null;
    if (await clip.edit([track.removalWithin(from, to)])) {
        clip.tellDone(`Deleted: the boxes of target ${track.target.id} from frame ${from} to ${to}`);
    }
}
