// Files in and out: import, upload, export.

import * as api from './requests.mjs';
import { ask, byId, counted, element, openDialog, save } from './dom.mjs';
import { whatIsLeft } from './left.mjs';
import { complain, tell } from './notices.mjs';

/** @typedef {import('./editor.mjs').Editor} Editor */

const EXPORTS = [
    ['csv', 'Patchlock table', 'one line per frame and target, with score and status'],
    ['mot', 'MOTChallenge', 'a text file for TrackEval and motmetrics'],
    ['cvat', 'CVAT for video 1.1', 'XML with key frames, to continue in CVAT'],
    ['coco', 'COCO with tracks', 'JSON with videos and track_id'],
    ['label-studio', 'Label Studio', 'a task with VideoRectangle'],
    ['yolo', 'YOLO', 'a folder with images and labels, to train a detector; .zip'],
    ['voc', 'Pascal VOC', 'a folder with annotations; .zip'],
    ['lasot', 'LaSOT', 'a folder for each target; .zip'],
    ['got10k', 'GOT-10k', 'a folder for each target; .zip'],
];
const IMPORTS = [
    ['csv', 'Patchlock table (.csv)'],
    ['mot', 'MOTChallenge (.txt)'],
    ['cvat', 'CVAT for video 1.1 (.xml)'],
    ['coco', 'COCO with tracks (.json)'],
];
const VIDEOS = /\.(mp4|m4v|mov|avi|mkv|webm|y4m|mpg|mpeg|ts|wmv)$/i;

/** @param {Editor} editor */
export function openExport(editor) {
    const { clip, track } = editor;
    if (!clip) return;
    if (clip.tracks.length === 0 && editor.clips.length < 2) return tell('There is no target to export yet.');
    const base = clip.info.name.replace(/\.[^.]+$/, '').replace(/[\\/:*?"<>|]/g, '_');
    const download = (/** @type {string} */ path, /** @type {string} */ name) => {
        dialog.close();
        void fetchFile(`${clip.path}${path}`, name);
    };
    const options = exportOptions();
    const formats = EXPORTS.map(([format = '', name = '', what = '']) =>
        row(name, what, () => download(`/export?format=${format}${options.query()}`, `${base}.${format}`)),
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
    const all = allClips(editor, () => dialog);
    const one = [
        element('ul', { class: 'choices' }, ...formats),
        options.part,
        element('h3', { text: 'Video' }),
        element('ul', { class: 'choices' }, ...videos),
    ];
    const many = [element('h3', { text: 'All clips as one data set' }), all];
    const isOne = editor.clips.length < 2;
    const content = isOne ? one : [...many, element('h3', { text: clip.info.name }), ...one];
    content.unshift(...whatIsLeft(editor).map((text) => element('p', { class: 'hint left', text })));
    const dialog = openDialog('Export', content);
}

/**
 * One folder with all clips, in which labels have the same classes.
 * @param {Editor} editor
 * @param {() => HTMLDialogElement} dialog
 */
function allClips(editor, dialog) {
    const format = element(
        'select',
        { attributes: { 'aria-label': 'Format of the data set' } },
        ...EXPORTS.map(([id = '', name = '']) =>
            element('option', { text: name, attributes: { value: id, selected: id === 'yolo' } }),
        ),
    );
    const val = element('input', {
        attributes: { value: editor.clips.length > 1 ? '0.2' : '', maxlength: 1000, class: 'numbers' },
    });
    const frames = element('input', { attributes: { type: 'checkbox', checked: true } });
    const get = () => {
        dialog().close();
        const query = `format=${format.value}&frames=${frames.checked}&val=${encodeURIComponent(val.value)}`;
        void fetchFile(`/export?${query}`, `clips.${format.value}.zip`);
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
        element('label', {}, 'Format', format),
        element('label', {}, 'For validation: a share of the clips, or names with commas between', val),
        element('label', {}, frames, 'With the frames as images'),
        button,
    );
}

/** What some formats can have in addition. */
function exportOptions() {
    const frames = element('input', { attributes: { type: 'checkbox', checked: true } });
    const every = element('input', { attributes: { type: 'number', min: 1, max: 1000, value: 1 } });
    const part = element(
        'div',
        { class: 'export-options' },
        element('label', {}, frames, 'Folders have the frames as images, too'),
        element('label', {}, 'CVAT, Label Studio: of the tracked frames, a key frame every', every),
    );
    const query = () => `&frames=${frames.checked}&key_frames=${Math.max(1, every.valueAsNumber || 1)}`;
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
        tell(`Saved: ${file.name || name}`);
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
    const input = element('input', { attributes: { type: 'file', 'aria-label': 'File to import' } });
    input.addEventListener('change', () => {
        const [file] = input.files ?? [];
        if (!file) return;
        dialog.close();
        void take(editor, file);
    });
    const text =
        'Boxes for this clip (our CSV, MOTChallenge, CVAT, COCO), or a video to add to the list. You can ' +
        'also drop a file anywhere on the page.';
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
    for (const file of files) await take(editor, file);
}

/**
 * @param {Editor} editor
 * @param {File} file
 */
async function take(editor, file) {
    if (VIDEOS.test(file.name) || file.type.startsWith('video/')) return upload(editor, file);
    const { clip } = editor;
    if (!clip) return complain('Open a clip first.', { doing: `${file.name} was not imported` });
    const format = await guess(file);
    const choices = element(
        'ul',
        { class: 'choices' },
        ...IMPORTS.map(([name = '', text = '']) => {
            const made = row(text, name === format ? 'This is what the file looks like.' : '', () => {
                dialog.close();
                void importBoxes(clip, file, name);
            });
            if (name === format) made.querySelector('button')?.setAttribute('autofocus', '');
            return made;
        }),
    );
    const text = `${file.name} is added to ${clip.info.name}. It can be undone.`;
    const dialog = openDialog('Import as', [element('p', { text }), choices]);
}

/** @param {File} file */
async function guess(file) {
    const start = (await file.slice(0, 2000).text()).trimStart();
    if (start.startsWith('<')) return 'cvat';
    if (start.startsWith('{') || start.startsWith('[')) return 'coco';
    return /^[a-z_"]/i.test(start) ? 'csv' : 'mot';
}

/**
 * What an import changes, in words.
 * @param {import('./clip.mjs').Clip} clip
 * @param {File} file
 * @param {import('./types').Preview} found
 */
function whatIsAdded(clip, file, { targets, keys, boxes, first, last, labels, attributes, there }) {
    const names = labels.map(
        ({ name, targets, new: isNew }) => `${name}${isNew ? ' (a new label)' : ''}: ${targets}`,
    );
    const words = [
        `${file.name} adds ${counted(targets, 'target')} to ${clip.info.name}`,
        ` (${names.join(', ')}), with ${boxes === 1 ? '1 box' : `${boxes} boxes`}`,
        ` in frames ${first} to ${last}; ${keys === 0 ? 'none' : keys} of them ${keys === 1 ? 'is a key frame' : 'are key frames'}. `,
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
 * @param {import('./clip.mjs').Clip} clip
 * @param {File} file
 * @param {string} format
 */
async function importBoxes(clip, file, format) {
    busy(`Reading ${file.name} …`);
    try {
        const found = await api.json('POST', `${clip.path}/import?format=${format}&preview=true`, {
            body: file,
        });
        busy(null);
        if (!(await ask('Import', whatIsAdded(clip, file, found), 'Import'))) return;
    } catch (error) {
        complain(error, { doing: `${file.name} was not imported` });
        return;
    } finally {
        busy(null);
    }
    busy(`Importing ${file.name} …`);
    try {
        const { targets } = await api.json('POST', `${clip.path}/import?format=${format}`, { body: file });
        await clip.load();
        const count = Array.isArray(targets) ? targets.length : targets;
        tell(`Imported ${counted(count, 'target')} from ${file.name}.`, {
            text: 'Undo',
            run: () => void clip.undo(),
        });
    } catch (error) {
        complain(error, { doing: `${file.name} was not imported` });
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
