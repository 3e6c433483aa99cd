// Plays the frames of the clip at a speed.

import { tell } from './notices.mjs';

/** @typedef {import('./editor.mjs').Editor} Editor */

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];

/**
 * Plays or pauses.
 * @param {Editor} editor
 */
export function togglePlay(editor) {
    if (editor.playing) return editor.goTo(editor.frame);
    editor.following = false;
    if (editor.frame >= editor.count - 1) editor.show(0);
    editor.playing = true;
    editor.began = { time: performance.now(), frame: editor.frame };
    requestAnimationFrame(() => play(editor));
    editor.changed();
}

/** @param {Editor} editor */
function play(editor) {
    if (!editor.playing || !editor.began) return;
    const passed = (performance.now() - editor.began.time) / 1000;
    const frame = Math.floor(editor.began.frame + passed * editor.rate * editor.speed);
    editor.stride = Math.max(1, Math.round(editor.speed));
    if (frame !== editor.frame) editor.show(frame);
    if (frame >= editor.count - 1) return editor.goTo(editor.count - 1);
    requestAnimationFrame(() => play(editor));
}

/**
 * @param {Editor} editor
 * @param {number} speed
 */
export function setSpeed(editor, speed) {
    editor.speed = speed;
    editor.began = { time: performance.now(), frame: editor.frame };
    editor.changed();
}

/**
 * @param {Editor} editor
 * @param {number} step
 */
export function changeSpeed(editor, step) {
    const at = SPEEDS.indexOf(editor.speed);
    setSpeed(editor, SPEEDS[Math.min(Math.max(0, at + step), SPEEDS.length - 1)] ?? 1);
    tell(`Speed ${editor.speed}×`);
}
