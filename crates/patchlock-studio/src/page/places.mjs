// What a window shows, so that it shows the same when it is loaded again.

const STORED = 'patchlock-place';

/**
 * @typedef {object} WindowState
 * @property {number} clip its id
 * @property {string} name of the clip: after another start of the program, the id may be that of another one
 * @property {number} frame
 * @property {number | null} selected
 * @property {{scale: number, x: number, y: number} | null} view
 */

/**
 * @param {import('./editor.mjs').Editor} editor
 * @param {import('./stage.mjs').Stage} stage
 */
export function write({ clip, frame, selected }, stage) {
    if (!clip) return;
    /** @type {WindowState} */
    const place = { clip: clip.info.id, name: clip.info.name, frame, selected, view: stage.place };
    sessionStorage.setItem(STORED, JSON.stringify(place));
}

/** @returns {WindowState | null} */
export function read() {
    return JSON.parse(sessionStorage.getItem(STORED) ?? 'null');
}
