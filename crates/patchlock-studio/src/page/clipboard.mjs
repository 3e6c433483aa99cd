// A box that is copied, to paste it in another frame or another clip.

import * as edits from './edits.mjs';
import { tell } from './notices.mjs';

/** @typedef {import('./editor.mjs').Editor} Editor */
/**
 * @typedef {object} ClipboardBox
 * @property {number} clip the clip in which a paste is a key frame of the selected target
 * @property {string} label
 * @property {import('./types').Box} box
 */

/**
 * Copies the box of the selected target in the frame shown, and its label.
 * @param {Editor} editor
 */
export function copyBox(editor) {
    const track = editor.needTarget();
    if (!track || !editor.clip) return;
    const frame = editor.shownFrame;
    const box = editor.boxOf(track, frame);
    if (!box) return tell(`There is no box in frame ${frame} to copy.`);
    const { id, label } = track.target;
    editor.copied = { clip: editor.clip.info.id, label, box };
    tell(`Copied: the box of ${label} ${id} in frame ${frame}. Ctrl+V pastes it in another frame or clip.`);
}

/**
 * Pastes the box into the frame shown: as a key frame of the selected target, or as a new target if none is
 * selected, or the box is from another clip. The new target is then the selected one.
 * @param {Editor} editor
 */
export async function pasteBox(editor) {
    const { clip, copied } = editor;
    if (!clip) return;
    if (!copied) return tell('No box is copied. Select a target and press Ctrl+C.');
    // As a drawn box, it belongs to the picture on the screen.
    editor.hold();
    if (editor.frame !== editor.shownFrame) editor.goTo(editor.shownFrame);
    const { frame } = editor;
    editor.cancelDraft();
    await clip.settled();
    if (clip !== editor.clip || !clip.loaded) return;
    const { box, label } = copied;
    const isNew = !editor.track || copied.clip !== clip.info.id;
    if (!isNew) return edits.setKey(editor, box, frame);
    editor.copied = { ...copied, clip: clip.info.id };
    await edits.addTarget(editor, box, label, frame);
}
