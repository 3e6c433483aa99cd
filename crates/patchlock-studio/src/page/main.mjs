// Puts the page together.

import * as edits from './edits.mjs';
import * as places from './places.mjs';
import * as playing from './playing.mjs';
import * as api from './requests.mjs';
import { Camera } from './camera.mjs';
import { ClipList } from './clips.mjs';
import { Commands, allCommands } from './commands.mjs';
import { byId, icon } from './dom.mjs';
import { Editor } from './editor.mjs';
import { acceptDrops, openExport, openImport } from './files.mjs';
import { complain } from './notices.mjs';
import { Panel, openLabels } from './panel.mjs';
import { Picture } from './picture.mjs';
import { nameOf } from './proposals.mjs';
import { Stage } from './stage.mjs';
import { Timeline } from './timeline.mjs';

for (const button of document.querySelectorAll('[data-icon]')) {
    button.prepend(icon(button.getAttribute('data-icon') ?? ''));
}

const editor = new Editor();
const stage = new Stage(editor);
const timeline = new Timeline(editor);
const panel = new Panel(editor);
const clipList = new ClipList(editor);
const picture = new Picture();
const camera = new Camera((clip) => void openRecording(clip));

const commands = new Commands(
    allCommands(editor, stage, {
        openLabels: () => openLabels(editor),
        // What is left in other clips may have changed.
        openExport: () => void editor.readClips().then(() => openExport(editor)),
        openImport: () => openImport(editor),
        toggleClips: () => clipList.toggle(),
        togglePicture: () => picture.toggle(),
        toggleCamera,
    }),
    editor,
);
commands.enabled = () => !camera.open;

/** Changes from the clips to the live camera, or back. */
function toggleCamera() {
    const open = !camera.open;
    document.body.classList.toggle('with-camera', open);
    byId('camera').hidden = !open;
    byId('work').hidden = open;
    document.querySelector('#head [data-command=camera]')?.setAttribute('aria-pressed', String(open));
    render();
    if (!open) return camera.hide();
    if (editor.playing) editor.goTo(editor.frame);
    void camera.show();
}
document.addEventListener('keydown', (event) => {
    if (!camera.open || document.querySelector('dialog[open]')) return;
    if (event.key === 'Escape' && camera.following) camera.stopFollowing();
    else if (event.key === 'Escape') toggleCamera();
});

/**
 * Shows a recording among the clips.
 * @param {number} id
 */
async function openRecording(id) {
    if (camera.open) toggleCamera();
    await editor.readClips();
    const info = editor.clips.find((clip) => clip.id === id);
    if (info) await editor.open(info);
}

let waiting = false;
/** Draws everything once before the next picture of the screen, however much has changed. */
function render() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
        waiting = false;
        stage.render();
        timeline.render();
        panel.render();
        renderBars();
    });
}
editor.addEventListener('change', render);
editor.addEventListener('ready', () => edits.offerToContinue(editor));

/**
 * @param {string} id
 * @param {string} text
 */
function write(id, text) {
    const place = byId(id);
    if (place.textContent !== text) place.textContent = text;
}

/** The head of the page and the transport. */
function renderBars() {
    const { clip } = editor;
    write('clip-title', camera.open ? 'Live camera' : (clip?.info.name ?? 'patchlock studio'));
    document.title = clip ? `${clip.info.name} · patchlock studio` : 'patchlock studio';
    byId('nothing').hidden = clip !== null || editor.clips.length > 0;
    const saved = !clip ? '' : !clip.connected ? 'No connection' : clip.unsaved ? 'Saving …' : 'Saved';
    write('saved', saved);
    byId('saved').classList.toggle('wrong', Boolean(clip && !clip.connected));
    byId('done').hidden = !clip?.loaded || camera.open;
    byId('done').setAttribute('aria-pressed', String(Boolean(clip?.project.done)));
    byId('windows').hidden = (clip?.windows ?? 1) < 2;
    write('windows', `${clip?.windows ?? 1} windows`);
    write('frame-count', `/ ${Math.max(0, editor.count - 1)}`);
    write('time', clockOf(editor.frame / editor.rate));
    const field = /** @type {HTMLInputElement} */ (byId('frame'));
    if (document.activeElement !== field) field.value = String(editor.frame);
    field.max = String(Math.max(0, editor.count - 1));
    byId('play')
        .querySelector('use')
        ?.setAttribute('href', editor.playing ? '#icon-pause' : '#icon-play');
    byId('play').setAttribute('aria-label', editor.playing ? 'Pause' : 'Play');
    /** @type {HTMLSelectElement} */ (byId('speed')).value = String(editor.speed);
    const doubts = clip?.doubts.length ?? 0;
    write('doubts-left', doubts ? String(doubts) : '');
    for (const [id, text] of /** @type {const} */ ([
        ['undo', clip?.undoText],
        ['redo', clip?.redoText],
    ])) {
        const button = byId(id);
        button.toggleAttribute('disabled', !text);
        const name = id === 'undo' ? 'Undo' : 'Redo';
        button.title = `${text ? `${name}: ${text}` : name} (${id === 'undo' ? 'Ctrl+Z' : 'Ctrl+Shift+Z'})`;
    }
    renderJob();
    renderHints();
}

function renderJob() {
    const job = editor.clip?.job;
    byId('job').hidden = !job;
    if (!job) return;
    byId('follow').setAttribute('aria-pressed', String(editor.following));
    const name = editor.clip?.name(job.target);
    const speed = job.fps > 0 ? ` · ${Math.round(job.fps)} frames/s` : '';
    const left = job.left === null ? '' : ` · ${job.left < 1 ? 'under 1' : Math.ceil(job.left)} s left`;
    const waiting = editor.clip?.waiting.map((id) => editor.clip?.name(id)).join(', ');
    write('job-text', `Tracking ${name}${speed}${left}${waiting ? ` · then ${waiting}` : ''}`);
}

function renderHints() {
    const text = hint();
    byId('hint').hidden = !text;
    write('hint', text);
}

/** What the page waits for, over the canvas. */
function hint() {
    const { clip, frames, hiddenFrom, doubt, frame } = editor;
    const failure = frames?.failure;
    if (failure) {
        return `Frame ${frame} can't be shown: ${failure instanceof Error ? failure.message : failure}`;
    }
    if (editor.joinFirst !== null)
        return 'Click the target to join, on the frame, below it or in the list. Esc cancels.';
    if (editor.polygon)
        return 'Click the points. Enter or a double click closes, Backspace removes the last one, Esc cancels.';
    if (editor.draft && editor.drawing) {
        return 'Drag a box; or arrows move, Shift+arrows resize, Enter accepts, Esc cancels.';
    }
    if (editor.proposal) {
        const left = editor.proposals.of(clip).length;
        return `${nameOf(editor.proposal)} Enter accepts it, Del rejects it, Y leaves it. ${left} to decide.`;
    }
    const others = (clip?.doubts.length ?? 1) - 1;
    const soFar = clip?.isBusy ? ' so far' : '';
    const more = others ? ` ${others} more to look at${soFar}.` : ` This is the last place${soFar}.`;
    if (editor.stretch && doubt?.untracked) {
        const { from, to } = editor.stretch;
        return `Not tracked yet: frames ${from} to ${to}. B tracks them, H if it is not visible there.${more}`;
    }
    if (editor.stretch) {
        const { from, to } = editor.stretch;
        return `Frames ${from} to ${to}: H not visible, B track again, Del delete the boxes. Esc cancels.`;
    }
    if (editor.markFrom !== null) {
        return `A stretch from frame ${editor.markFrom}: go to its last frame, press S. Esc cancels.`;
    }
    if (hiddenFrom !== null) {
        return `Not visible from frame ${hiddenFrom}: go to the last such frame, press H. Esc cancels.`;
    }
    if (doubt?.frame === frame) {
        const reason = doubt.reason.charAt(0).toUpperCase() + doubt.reason.slice(1);
        const isLost = editor.track?.at(frame).kind === 'lost';
        const hidden = editor.track?.isDoubtful(frame) ? ', Shift+H if it is not visible' : '';
        const what = isLost
            ? 'Draw the box; Enter if the dotted one is right, Shift+H if it is not visible while lost'
            : `Correct the box; Enter if it is right${hidden}`;
        return `${reason}. ${what}.${more}`;
    }
    return clip?.loaded && clip.tracks.length === 0 ? 'Drag a box around what is to be followed.' : '';
}

/** @param {number} seconds */
function clockOf(seconds) {
    const minutes = Math.floor(seconds / 60);
    return `${minutes}:${(seconds % 60).toFixed(2).padStart(5, '0')}`;
}

byId('frame').addEventListener('change', (event) => {
    const { valueAsNumber } = /** @type {HTMLInputElement} */ (event.target);
    if (Number.isFinite(valueAsNumber)) editor.goTo(valueAsNumber);
});
byId('frame').addEventListener('keydown', (event) => {
    if (event.key === 'Enter' || event.key === 'Escape') byId('stage').focus();
});
byId('speed').addEventListener('change', (event) => {
    playing.setSpeed(editor, Number(/** @type {HTMLSelectElement} */ (event.target).value));
    byId('stage').focus();
});
// Messages lie over the picture, and not over the timeline.
new ResizeObserver(() => {
    const { bottom, height } = byId('stage-part').getBoundingClientRect();
    const below = height > 0 ? Math.max(0, window.innerHeight - bottom) : 0;
    document.documentElement.style.setProperty('--below-stage', `${below + 16}px`);
}).observe(byId('stage-part'));
acceptDrops(editor);
window.addEventListener('pagehide', () => places.write(editor, stage));
window.addEventListener('beforeunload', (event) => {
    if (editor.clip?.unsaved || editor.proposals.of(editor.clip).length > 0) event.preventDefault();
});
window.addEventListener('unhandledrejection', (event) => complain(event.reason));
window.addEventListener('error', (event) => complain(event.error ?? event.message));
if (matchMedia('(max-width: 1100px)').matches) clipList.toggle();

const refusal = await api.signIn();
if (refusal) {
    complain(refusal);
} else {
    await editor.readClips();
    const readable = editor.clips.filter(({ error, opening }) => !error && !opening);
    const before = places.read();
    const again = readable.find(({ id, name }) => id === before?.clip && name === before.name);
    if (editor.startsWithCamera) toggleCamera();
    if (again && before) {
        const opened = editor.open(again, before);
        if (before.view) stage.showPlace(before.view);
        await opened;
    } else if (readable[0]) await editor.open(readable[0]);
    render();
}
