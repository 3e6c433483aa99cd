// What is left to do in clips, in words: doubtful places, and frames of which nothing is known.

import { counted } from './dom.mjs';

const MOST = 5;

/**
 * Of a clip that is open; empty if nothing is left.
 * @param {import('./clip.mjs').Clip} clip
 * @param {number} proposals how many wait
 */
export function whatIsLeftOf(clip, proposals) {
    const places = clip.doubts.length ? `Left: ${counted(clip.doubts.length, 'doubtful place')}.` : '';
    const unknown = clip.tracks.filter((track) => track.unknown() > 0);
    const names = unknown.map(
        (track) => `${track.target.label} ${track.target.id} in ${counted(track.unknown(), 'frame')}`,
    );
    const not = unknown.length ? `Not tracked: ${someOf(names, 'target')}.` : '';
    const busy = clip.isBusy ? 'Tracking has not ended yet.' : '';
    const undecided = proposals ? `Not decided: ${counted(proposals, 'proposal')}.` : '';
    return [places, not, undecided, busy].filter(Boolean).join(' ');
}

/**
 * Of all clips, a line for each with something left.
 * @param {import('./editor.mjs').Editor} editor
 */
export function whatIsLeft({ clip, clips, proposals }) {
    const name = clip?.info.name ?? '';
    const here = clip ? whatIsLeftOf(clip, proposals.of(clip).length) : '';
    const others = clips
        .filter(({ id, unknown }) => id !== clip?.info.id && unknown > 0)
        .map(
            (info) =>
                `${info.name}: ${counted(info.unknown_targets, 'target')} not tracked in ` +
                `${counted(info.unknown, 'frame')}`,
        );
    const lines = others.length ? [`${someOf(others, 'clip')}.`] : [];
    return here ? [`${name}: ${here}`, ...lines] : lines;
}

/**
 * The first of some names, and how many more there are.
 * @param {string[]} names
 * @param {string} word
 */
function someOf(names, word) {
    const more = names.length - MOST;
    const some = names.slice(0, MOST).join(', ');
    return more > 0 ? `${some} and ${counted(more, `more ${word}`)}` : some;
}
