// Files in and out: import, upload, export.

import * as api from './requests.mjs';
import { ask, byId, choose, counted, element, openDialog, save } from './dom.mjs';
import { whatIsLeft } from './left.mjs';
import { complain, tell } from './notices.mjs';
import { goToNext } from './proposals.mjs';

/** @typedef {import('./editor.mjs').Editor} Editor */

const VIDEOS = /\.(mp4|m4v|mov|avi|mkv|webm|y4m|mpg|mpeg|ts|wmv)$/i;

/** @typedef {import('./types').ExportFormat} ExportFormat */

/** @param {Editor} editor */
export async function openExport(editor) {
    const { clip, track } = editor;
    if (!clip) return;
    if (clip.tracks.length === 0 && editor.clips.length < 2) return tell('There is no target to export yet.');
    /** @type {ExportFormat[]} */
    let exports;
    try {
        ({ exports } = await api.json('GET', '/formats'));
    } catch (error) {
        return complain(error, { doing: 'The export failed', topic: 'export' });
    }
    const base = clip.info.name.replace(/\.[^.]+$/, '').replace(/[\\/:*?"<>|]/g, '_');
    const download = (/** @type {string} */ path, /** @type {string} */ name) => {
        dialog.close();
        void fetchFile(`${clip.path}${path}`, name);
    };
    const options = exportOptions();
    const formats = exports.map((format) =>
        row(format.title, format.content + (format.folder ? '; .zip' : ''), () =>
            download(`/export?${options.query(format)}`, `${base}.${format.name}`),
        ),
    );
    const videos = [
        row('Annotated video', 'MP4 with boxes, labels and scores drawn in', () =>
            download('/video', `${base}.annotated.mp4`),
        ),
    ];
    if (track) {
        const { id, label } = track.target;
        const get = () => download(`/targets/${id}/clip`, `${base}.${id}.mp4`);
        videos.push(row(`Clip of ${label} ${id}`, 'MP4 cut around the selected target', get));
    }
    const all = allClips(editor, exports, options, () => dialog);
    const one = [
        element('ul', { class: 'choices' }, ...formats),
        element('h3', { text: 'Video' }),
        element('ul', { class: 'choices' }, ...videos),
    ];
    const many = [element('h3', { text: 'All clips as one data set' }), all];
    const isOne = editor.clips.length < 2;
    const content = isOne ? one : [...many, element('h3', { text: clip.info.name }), ...one];
    content.unshift(options.part);
    content.unshift(...whatIsLeft(editor).map((text) => element('p', { class: 'hint left', text })));
    const dialog = openDialog('Export', content);
}

/**
 * One folder with all clips, in which labels have the same classes.
 * @param {Editor} editor
 * @param {ExportFormat[]} exports
 * @param {ReturnType<typeof exportOptions>} options
 * @param {() => HTMLDialogElement} dialog
 */
function allClips(editor, exports, options, dialog) {
    const choice = element(
        'select',
        { attributes: { 'aria-label': 'Format of the data set' } },
        ...exports.map(({ name, title }) =>
            element('option', { text: title, attributes: { value: name, selected: name === 'yolo' } }),
        ),
    );
    const val = element('input', {
        attributes: { value: editor.clips.length > 1 ? '0.2' : '', maxlength: 1000, class: 'numbers' },
    });
    const get = () => {
        const format = exports.find(({ name }) => name === choice.value);
        if (!format) return;
        dialog().close();
        const query = `${options.query(format)}&val=${encodeURIComponent(val.value)}`;
        void fetchFile(`/export?${query}`, `clips.${format.name}.zip`);
    };
    const button = element('button', {
        class: 'primary',
        text: `Export ${counted(editor.clips.length, 'clip')}`,
        attributes: { type: 'button' },
        on: { click: get },
    });
    return element(
        'div',
        { class: 'export-options export-all' },
        element('label', {}, 'Format', choice),
        element('label', {}, 'For validation: a share of the clips, or names with commas between', val),
        button,
    );
}

/** Which boxes are written, and what some formats can have in addition. */
function exportOptions() {
    const number = (/** @type {Record<string, string | number>} */ attributes) =>
        element('input', { attributes: { type: 'number', ...attributes } });
    const frames = element('input', { attributes: { type: 'checkbox', checked: true } });
    const keys = number({ min: 0.01, max: 1000, step: 'any', value: 1 });
    const score = number({ min: 0, max: 1, step: 'any', placeholder: 'any' });
    const every = number({ min: 1, max: 100000, value: 1 });
    const statuses = [
        ['', 'to train a detector the tracked ones, otherwise all'],
        ['tracked', 'tracked'],
        ['tracked,uncertain', 'tracked and uncertain'],
        ['uncertain', 'uncertain'],
    ];
    const status = element(
        'select',
        {},
        ...statuses.map(([value = '', text = '']) => element('option', { text, attributes: { value } })),
    );
    const part = element(
        'div',
        { class: 'export-options' },
        element('label', {}, 'Boxes, besides key frames', status),
        element('label', {}, 'with a score of at least', score),
        element('label', {}, 'of every so many-th frame', every),
        element('label', {}, frames, 'Folders have the frames as images, too'),
        element(
            'label',
            {},
            'CVAT, Label Studio: a key frame every so many frames, or, below 1, the least overlap',
            keys,
        ),
    );
    const query = (/** @type {ExportFormat} */ format) => {
        const asked = new URLSearchParams({ format: format.name, frames: String(frames.checked) });
        if (status.value) asked.set('status', status.value);
        if (score.value) asked.set('min_score', score.value);
        // Tools with key frames have all frames.
        if (!format.key_frames && every.value) asked.set('every', every.value);
        if (format.key_frames && keys.value) asked.set('key_frames', keys.value);
        return asked;
    };
    return { part, query };
}

/**
 * @param {string} name
 * @param {string} what
 * @param {() => void} click
 */
function row(name, what, click) {
    return element(
        'li',
        {},
        element(
            'button',
            { class: 'choice', attributes: { type: 'button' }, on: { click } },
            element('span', { class: 'choice-name', text: name }),
            element('span', { class: 'choice-what', text: what }),
        ),
    );
}

/**
 * @param {string} path
 * @param {string} name used if the server gives none
 */
async function fetchFile(path, name) {
    const stop = new AbortController();
    busy('Writing the file …', () => stop.abort());
    try {
        const file = await api.file(path, stop.signal);
        save(file.blob, file.name || name);
        tell([`Saved: ${file.name || name}`, file.remarks].filter(Boolean).join('. '));
    } catch (error) {
        complain(error, { doing: 'The export failed', topic: 'export' });
    } finally {
        busy(null);
    }
}

/**
 * Says that something takes a while.
 * @param {string | null} text
 * @param {() => void} [stop]
 */
function busy(text, stop) {
    const place = byId('busy');
    place.hidden = text === null;
    place.replaceChildren();
    if (text === null) return;
    place.append(element('span', { class: 'spinner' }), element('span', { text }));
    if (stop)
        place.append(
            element('button', { text: 'Cancel', attributes: { type: 'button' }, on: { click: stop } }),
        );
}

/** @param {Editor} editor */
export function openImport(editor) {
    const attributes = { type: 'file', multiple: true, 'aria-label': 'File to import' };
    const input = element('input', { attributes });
    input.addEventListener('change', () => {
        const files = [...(input.files ?? [])];
        if (files.length === 0) return;
        dialog.close();
        void takeAll(editor, files);
    });
    const text =
        'Boxes for this clip (our CSV, MOTChallenge, CVAT, COCO, Label Studio; all files of YOLO or Pascal ' +
        'VOC together), or a video to add to the list. You can also drop files anywhere on the page.';
    const dialog = openDialog('Import', [element('p', { text }), input]);
}

/**
 * Files that are dropped on the page.
 * @param {Editor} editor
 */
export function acceptDrops(editor) {
    const veil = byId('drop');
    let inside = 0;
    const has = (/** @type {DragEvent} */ event) => event.dataTransfer?.types.includes('Files');
    const leave = () => {
        inside = 0;
        veil.hidden = true;
    };
    document.addEventListener('dragenter', (event) => {
        if (!has(event)) return;
        inside += 1;
        veil.hidden = false;
    });
    document.addEventListener('dragleave', (event) => {
        if (has(event) && (inside -= 1) <= 0) leave();
    });
    document.addEventListener('dragover', (event) => {
        if (has(event)) event.preventDefault();
    });
    document.addEventListener('drop', (event) => {
        if (!has(event)) return;
        event.preventDefault();
        leave();
        void takeAll(editor, [...(event.dataTransfer?.files ?? [])]);
    });
}

/**
 * @param {Editor} editor
 * @param {File[]} files
 */
async function takeAll(editor, files) {
    const isVideo = (/** @type {File} */ file) => VIDEOS.test(file.name) || file.type.startsWith('video/');
    for (const file of files.filter(isVideo)) await upload(editor, file);
    const others = files.filter((file) => !isVideo(file));
    // Files of images belong together; others are imported one after another.
    const likely = await Promise.all(others.slice(0, 20).map(guess));
    const ofImages = likely.find((format) => format === 'yolo' || format === 'voc');
    if (ofImages && others.length > 1) return take(editor, others, ofImages);
    for (const file of others) await take(editor, [file], await guess(file));
}

/**
 * @param {Editor} editor
 * @param {File[]} files one, or those of a format with a file for each image
 * @param {string} likely the format that they look like
 */
async function take(editor, files, likely) {
    const { clip } = editor;
    const [file] = files;
    if (!file) return;
    const name =
        files.length === 1 ? file.name : `${file.name} and ${counted(files.length - 1, 'other file')}`;
    if (!clip) return complain('Open a clip first.', { doing: `${name} was not imported` });
    /** @type {import('./types').ImportFormat[]} */
    let imports;
    try {
        ({ imports } = await api.json('GET', '/formats'));
    } catch (error) {
        return complain(error, { doing: `${name} was not imported` });
    }
    const possible = imports.filter((format) => files.length === 1 || format.files);
    const choices = element(
        'ul',
        { class: 'choices' },
        ...possible.map((format) => {
            const isLikely = format.name === likely;
            const made = row(format.title, isLikely ? 'This is what the file looks like.' : '', () => {
                dialog.close();
                void importBoxes(editor, clip, name, files, format);
            });
            if (isLikely) made.querySelector('button')?.setAttribute('autofocus', '');
            return made;
        }),
    );
    const text = `${name} is added to ${clip.info.name}. It can be undone.`;
    const dialog = openDialog('Import as', [element('p', { text }), choices]);
}

/** @param {File} file */
async function guess(file) {
    const start = (await file.slice(0, 2000).text()).trimStart();
    if (start.startsWith('<')) return /<annotation[\s>]/.test(start) ? 'voc' : 'cvat';
    if (start.startsWith('[')) return /"image_id"/.test(start) ? 'coco' : 'label-studio';
    if (start.startsWith('{')) return /"(images|annotations|info|licenses)"/.test(start) ? 'coco' : 'csv';
    if (/\.(ya?ml|names)$/i.test(file.name) || /^\d+( [-\d.e]+){4,}/.test(start)) return 'yolo';
    return /^[a-z_"]/i.test(start) ? 'csv' : 'mot';
}

/**
 * What an import changes, in words.
 * @param {import('./clip.mjs').Clip} clip
 * @param {string} name
 * @param {import('./types').Preview} found
 */
function whatIsAdded(clip, name, { targets, keys, boxes, first, last, labels, attributes, there, notes }) {
    const names = labels.map(
        ({ name, targets, new: isNew }) => `${name}${isNew ? ' (a new label)' : ''}: ${targets}`,
    );
    const words = [
        `${name} adds ${counted(targets, 'target')} to ${clip.info.name}`,
        ` (${names.join(', ')}), with ${boxes === 1 ? '1 box' : `${boxes} boxes`}`,
        ` in frames ${first} to ${last}; ${keys === 0 ? 'none' : keys} of them ${keys === 1 ? 'is a key frame' : 'are key frames'}. `,
        ...notes.map((note) => `${note}. `),
        'What is there stays as it is. ',
        ...Object.entries(attributes).map(
            ([label, names]) => `The label ${label} declares ${names.join(', ')} from then on. `,
        ),
        there
            ? `${counted(there, 'target')} of the file ${there === 1 ? 'begins' : 'begin'} with a box that is here already. `
            : '',
        'It can be undone.',
    ];
    return words.join('');
}

/**
 * Asks whether to import, and how.
 * @param {string} text
 * @param {number} proposals
 */
async function chooseImport(text, proposals) {
    const hint = ' As proposals, the first box of each target waits, dashed, until you accept or reject it.';
    // Without a box that a person could have drawn, nothing can wait.
    if (proposals === 0) return (await ask('Import', text, 'Import')) ? 'import' : null;
    const answers = ['Cancel', `As ${counted(proposals, 'proposal')}`, 'Import'];
    const answer = await choose('Import', text + hint, answers);
    return answer === 1 ? 'proposals' : answer === 2 ? 'import' : null;
}

/**
 * Lets boxes wait for a decision.
 * @param {Editor} editor
 * @param {import('./clip.mjs').Clip} clip
 * @param {import('./types').Proposal[]} found
 */
function propose(editor, clip, found) {
    editor.proposals.add(clip, found);
    if (clip.info.id === editor.clip?.info.id) goToNext(editor);
}

/**
 * @param {Editor} editor
 * @param {import('./clip.mjs').Clip} clip
 * @param {string} name what the files are called in messages
 * @param {File[]} files
 * @param {import('./types').ImportFormat} format
 */
async function importBoxes(editor, clip, name, files, format) {
    const path = `${clip.path}/import?format=${format.name}`;
    /** @type {Blob | undefined} */
    let body = files[0];
    busy(`Reading ${name} …`);
    try {
        if (format.files) {
            const texts = await Promise.all(
                files.map(async (file) => [file.webkitRelativePath || file.name, await file.text()]),
            );
            body = new Blob([JSON.stringify(Object.fromEntries(texts))]);
        }
        const found = await api.json('POST', `${path}&preview=true`, { body });
        busy(null);
        const { proposals } = found;
        const answer = await chooseImport(whatIsAdded(clip, name, found), proposals.length);
        if (answer === 'proposals') propose(editor, clip, proposals);
        if (answer !== 'import') return;
    } catch (error) {
        complain(error, { doing: `${name} was not imported` });
        return;
    } finally {
        busy(null);
    }
    busy(`Importing ${name} …`);
    try {
        const { targets } = await api.json('POST', path, { body });
        await clip.load();
        const count = Array.isArray(targets) ? targets.length : targets;
        clip.tellDone(`Imported ${counted(count, 'target')} from ${name}.`);
    } catch (error) {
        complain(error, { doing: `${name} was not imported` });
    } finally {
        busy(null);
    }
}

/**
 * @param {Editor} editor
 * @param {File} file
 */
async function upload(editor, file) {
    busy(`Adding ${file.name} …`);
    try {
        const made = await api.json('POST', `/clips?name=${encodeURIComponent(file.name)}`, { body: file });
        await editor.readClips();
        const id = made.id ?? made.clip?.id;
        const info = editor.clips.find((clip) => clip.id === id) ?? editor.clips.at(-1);
        if (info) await editor.open(info);
    } catch (error) {
        complain(error, { doing: `${file.name} was not added` });
    } finally {
        busy(null);
    }
}
