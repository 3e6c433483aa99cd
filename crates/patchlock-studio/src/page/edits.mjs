// Changes of targets, key frames and labels, and the tracking that follows.

import { ask, choose as chooseAnswer, counted } from './dom.mjs';
import { tell } from './notices.mjs';
import { inEdit } from './outline.mjs';
import { tidy } from './tracks.mjs';

/** @typedef {import('./editor.mjs').Editor} Editor */
/** @typedef {import('./types').Box} Box */
/** @typedef {import('./types').Direction} Direction */

/**
 * What a click on a target means: to join it, if that was asked for, or to select it.
 * @param {Editor} editor
 * @param {number} id
 */
export function choose(editor, id) {
    if (editor.joinFirst !== null) void join(editor, id);
    else if (id !== editor.selected) editor.select(id);
}

/**
 * The target that a new box belongs to: the selected one where it has no box, or is lost; otherwise none.
 * @param {Editor} editor
 */
export function targetOfNewBox(editor) {
    const kind = editor.track?.at(editor.shownFrame).kind;
    return kind === 'none' || kind === 'lost' || kind === 'hidden' ? editor.selected : null;
}

/**
 * What a new box is if the selected target has another one in this frame: asked once, then remembered while
 * the page is open. Answers whether it is that of another target, or null if it is neither.
 * @param {Editor} editor
 */
export async function isOfAnother(editor) {
    const { track } = editor;
    if (!track || editor.newIsAnother !== null) return editor.newIsAnother ?? true;
    const name = `${track.target.label} ${track.target.id}`;
    const answer = await chooseAnswer(
        'Whose box is it?',
        `${name} is selected and has a box in this frame. The answer holds until the page is closed. ` +
            'Whatever it is, Shift and a drag draw another target.',
        [`Correct the box of ${name}`, 'Another target'],
    );
    if (answer !== null) editor.newIsAnother = answer === 1;
    return editor.newIsAnother;
}

/**
 * Makes a drawn box that of the selected target, and offers the other meaning.
 * @param {Editor} editor
 * @param {Box} box
 */
export async function correct(editor, box) {
    const { clip, track, frame } = editor;
    if (!clip || !track) return;
    const asAnother = async () => {
        await clip.undo();
        if (editor.frame !== frame) editor.goTo(frame);
        await addTarget(editor, box);
    };
    const name = `${track.target.label} ${track.target.id}`;
    await setKey(editor, box, frame, () =>
        tell(`This is now the box of ${name} in frame ${frame}.`, {
            text: 'Another target',
            run: () => void asAnother(),
        }),
    );
}

/**
 * Adds a target with a first box, and tracks it as the person has chosen.
 * @param {Editor} editor
 * @param {Box} box
 * @param {string} [label]
 * @param {number} [frame]
 */
export async function addTarget(editor, box, label = editor.label ?? 'object', frame = editor.frame) {
    const { clip } = editor;
    if (!clip) return;
    const before = new Set();
    const edits = () => {
        clip.tracks.forEach(({ target }) => before.add(target.id));
        return [...newLabels(clip, [label]), { edit: 'add_target', label, frame, ...inEdit(tidy(box)) }];
    };
    const pending = { target: null, frame, box };
    editor.pendingBox = pending;
    editor.adding += 1;
    await clip.editAndTrack(edits, async (since) => {
        if (editor.pendingBox === pending) editor.pendingBox = null;
        if (clip !== editor.clip) return;
        editor.adding = Math.max(0, editor.adding - 1);
        const added = clip.tracks.find(({ target }) => !before.has(target.id));
        if (!added) return;
        // What is being drawn by now is of another target, and selecting this one would end it.
        if (!editor.draft && !editor.drawing) editor.select(added.target.id);
        const { afterDrawing } = editor;
        if (afterDrawing !== 'none' && afterDrawing !== 'interpolate')
            await startTracking(editor, afterDrawing, frame, { since, track: added });
    });
}

/**
 * The edits that add those labels that the clip does not have.
 * @param {import('./clip.mjs').Clip} clip
 * @param {string[]} labels
 */
export function newLabels(clip, labels) {
    const known = new Set(clip.project.labels.map(({ name }) => name));
    const unknown = [...new Set(labels)].filter((name) => !known.has(name));
    return unknown.map((name) => ({ edit: 'add_label', name }));
}

/**
 * Makes the frame a key frame with this box. What lies between the neighbouring key frames is tracked
 * again, if anything there was tracked before.
 * @param {Editor} editor
 * @param {Box} box
 * @param {number} [frame]
 * @param {() => void} [made] called when it is one
 */
export async function setKey(editor, box, frame = editor.frame, made = () => {}) {
    const { clip, track } = editor;
    if (!clip || !track) return;
    const target = track.target.id;
    const pending = { target, frame, box };
    editor.pendingBox = pending;
    const edits = () => {
        const { occluded = false, truncated = false } = clip.track(target)?.at(frame) ?? {};
        return [{ edit: 'set_key', target, frame, ...inEdit(tidy(box)), occluded, truncated }];
    };
    await clip.editAndTrack(edits, async (since) => {
        // The next box of the same target may be on its way already.
        if (editor.pendingBox === pending) editor.pendingBox = null;
        editor.changed();
        const now = clip.track(target);
        if (!now) return;
        made();
        const wasTracked = Object.keys(now.target.tracked).length > 0 || now.keys.length > 1;
        if (editor.afterDrawing === 'interpolate') await interpolateIn(editor, now, frame, frame);
        else if (wasTracked || editor.afterDrawing !== 'none') await trackAround(clip, now, frame, since);
    });
}

/**
 * Puts boxes on straight lines between the key frames around this frame, or between all that have a part of the
 * marked stretch between them. Nothing is tracked.
 * @param {Editor} editor
 */
export async function interpolate(editor) {
    const { from, to } = editor.stretch ?? { from: editor.frame, to: editor.frame };
    const track = await editor.settledTarget();
    if (!track) return;
    if (!(await interpolateIn(editor, track, from, to))) {
        tell('There are no two neighbouring key frames here to interpolate between.');
    }
}

/**
 * @param {Editor} editor
 * @param {import('./tracks.mjs').Track} track
 * @param {number} from
 * @param {number} to
 */
async function interpolateIn(editor, track, from, to) {
    const edits = track.interpolated(from, to);
    return edits.length > 0 && (await editor.clip?.edit(edits));
}

/**
 * Confirms the box of this frame, or takes the key frame away.
 * @param {Editor} editor
 */
export async function toggleKey(editor) {
    const { clip, frame } = editor;
    const track = await editor.settledTarget();
    if (!track || !clip) return;
    if (track.at(frame).kind !== 'key') return confirm(editor, frame);
    if (track.keys.length === 1) {
        return tell('This is the only key frame. Delete the target instead (Delete).');
    }
    await clip.editAndTrack([{ edit: 'remove_key', target: track.target.id, frame }], async (since) => {
        const now = clip.track(track.target.id);
        if (now) await trackAround(clip, now, frame, since);
    });
}

/**
 * @param {import('./clip.mjs').Clip} clip
 * @param {import('./tracks.mjs').Track} track
 * @param {number} frame
 * @param {number} since the revision of the change that it follows
 */
async function trackAround(clip, track, frame, since) {
    const request = track.requestAround(frame);
    if (request) await clip.startTracking({ ...request, since });
}

/**
 * Makes the box of a frame a key frame as it is.
 * @param {Editor} editor
 * @param {number} [frame]
 */
export async function confirm(editor, frame = editor.frame) {
    const track = await editor.settledTarget();
    if (!track) return;
    const { box, kind } = track.at(frame);
    if (!box) return tell('There is no box in this frame. Draw one, or press E.');
    if (kind === 'key') return tell('This is a key frame already.');
    await setKey(editor, box, frame);
}

/**
 * @param {Editor} editor
 * @param {'occluded' | 'truncated'} name
 */
export async function toggleFlag(editor, name) {
    const track = editor.needTarget();
    const { clip, frame } = editor;
    if (!track || !clip) return;
    const target = track.target.id;
    if (!track.at(frame).box) return tell('There is no box in this frame.');
    await clip.edit(() => {
        const seen = clip.track(target)?.at(frame);
        if (!seen?.box) return [];
        const flags = { occluded: seen.occluded, truncated: seen.truncated, [name]: !seen[name] };
        return [{ edit: 'set_key', target, frame, ...inEdit(seen.box), ...flags }];
    });
}

/** @param {Editor} editor */
export async function deleteTarget(editor) {
    const track = editor.needTarget();
    const { clip } = editor;
    if (!track || !clip) return;
    const { id, label } = track.target;
    if (await clip.edit([{ edit: 'delete_target', target: id }])) {
        clip.tellDone(`Deleted: ${label} ${id}`);
    }
}

/** @param {Editor} editor */
export async function split(editor) {
    const track = editor.needTarget();
    const { frame } = editor;
    if (!track) return;
    if (await editor.clip?.edit([{ edit: 'split', target: track.target.id, frame }])) {
        tell(`From frame ${frame} on it is a target of its own.`);
    }
}

/**
 * Joins another target to the selected one.
 * @param {Editor} editor
 * @param {number} second
 */
export async function join(editor, second) {
    const first = editor.joinFirst ?? editor.selected;
    editor.joinFirst = null;
    editor.changed();
    if (first === null || first === second) return;
    if (await editor.clip?.edit([{ edit: 'join', first, second }])) {
        editor.select(first);
        tell(`Target ${second} is now part of target ${first}.`);
    }
}

/**
 * The next target that is clicked is joined to the selected one.
 * @param {Editor} editor
 */
export function beginJoin(editor) {
    if (!editor.needTarget()) return;
    if ((editor.clip?.tracks.length ?? 0) < 2) return tell('There is no other target to join.');
    editor.joinFirst = editor.selected;
    editor.changed();
}

/**
 * @param {Editor} editor
 * @param {string} label
 * @param {number | null} [id] the target; without it the selected one
 */
export async function setLabel(editor, label, id = editor.selected) {
    const { clip } = editor;
    editor.label = label;
    editor.changed();
    const before = id === null ? label : clip?.track(id)?.target.label;
    const made = id !== null && (await clip?.edit([{ edit: 'set_target', target: id, label }]));
    if (clip && made && before !== undefined && before !== label) offerLabel(clip, before, label);
}

/**
 * Offers to give a label to all other targets of the label that a target had, such as `class 3` of an import.
 * @param {import('./clip.mjs').Clip} clip
 * @param {string} before
 * @param {string} label
 */
function offerLabel(clip, before, label) {
    const others = () => clip.project.targets.filter((target) => target.label === before);
    const count = others().length;
    if (count === 0) return;
    const run = () =>
        void clip.edit(() => others().map(({ id }) => ({ edit: 'set_target', target: id, label })));
    tell(`Still ${before}: ${counted(count, 'other target')}.`, { text: `Make all ${label}`, run });
}

/**
 * @param {Editor} editor
 * @param {number} at position in the list of labels
 */
export async function setLabelAt(editor, at) {
    const label = editor.clip?.project.labels[at];
    if (!label) return tell(`There is no label ${at + 1}. Press L to add one.`);
    await setLabel(editor, label.name);
}

/**
 * @param {Editor} editor
 * @param {Direction} direction
 * @param {number} [from]
 * @param {{since: number, track: import('./tracks.mjs').Track}} [drawn] the revision of the change that it follows,
 *     and the target that was drawn; without it the selected one. The picture stays where the person draws, and
 *     follows what they ask for with a key
 */
export async function startTracking(editor, direction, from = editor.frame, drawn) {
    const { clip } = editor;
    const track = drawn?.track ?? (await editor.settledTarget());
    if (!track || !clip) return;
    const target = track.target.id;
    const seen = track.at(from);
    if (!seen.box) return tell('There is no box in this frame to track from.');
    if (seen.kind === 'lost') return tell('The target is lost here. Draw its box first.');
    // A person who has moved on meanwhile stays there.
    if (!drawn && editor.frame === from) {
        editor.following = true;
        editor.stride = direction === 'backward' ? -1 : 1;
    }
    const begin = async (/** @type {number | undefined} */ revision) => {
        await clip.startTracking({ target, from, direction, since: revision });
    };
    if (seen.kind === 'key') return begin(drawn?.since);
    // Tracking starts at what a person has drawn or confirmed.
    await clip.editAndTrack([{ edit: 'set_key', target, frame: from, ...inEdit(seen.box) }], begin);
}

/**
 * Tracks the stretch of the selected target about which nothing is known, from the nearest key frame.
 * @param {Editor} editor
 */
export async function continueTracking(editor) {
    const { frame } = editor;
    const track = await editor.settledTarget();
    const gap = track?.gap();
    if (!track || !gap) return;
    const request = track.requestWithin(gap.from, gap.to);
    if (!request) return tell('No key frame leads there: go there and draw its box.');
    if (editor.frame === frame) editor.following = true;
    await editor.clip?.startTracking(request);
}

/**
 * Offers to go on where tracking was broken off, as by a crash of the program.
 * @param {Editor} editor
 */
export function offerToContinue(editor) {
    const { clip } = editor;
    if (!clip || clip.job) return;
    const broken = clip.tracks.find((track) => {
        const gap = track.gap();
        return gap?.after && track.known.length > track.keys.length;
    });
    if (!broken) return;
    const { label, id } = broken.target;
    const share = Math.max(1, Math.round((100 * broken.unknown()) / Math.max(1, broken.frames)));
    tell(`${label} ${id}: ${share} % of the clip is not tracked.`, {
        text: 'Continue',
        run: () => {
            editor.select(id);
            void continueTracking(editor);
        },
    });
}

/**
 * @param {Editor} editor
 * @param {string} name
 */
export async function removeLabel(editor, name) {
    const users = editor.clip?.project.targets.filter(({ label }) => label === name).length ?? 0;
    if (users > 0) return tell(`The label ${name} is in use: ${counted(users, 'target')}.`);
    if (await ask('Remove label', `Remove the label ${name}?`, 'Remove')) {
        await editor.clip?.edit([{ edit: 'remove_label', name }]);
    }
}
