// The panel beside the canvas: targets, the selected one, what the tracker sees, doubtful places.

import * as edits from './edits.mjs';
import * as stretches from './stretches.mjs';
import { Values, openAttributes, openSchema } from './attributes.mjs';
import { byId, counted, element, iconButton, openDialog } from './dom.mjs';
import { drawHidden } from './drawing.mjs';
import { inNumbers, inWords } from './editor.mjs';
import { copy, thumbnails } from './frames.mjs';
import { reject, setLeastScore } from './proposals.mjs';
import { renderRemarks } from './review.mjs';
import { asBox } from './tracks.mjs';

/** @typedef {import('./editor.mjs').Editor} Editor */

const DOUBTS_SHOWN = 40;
const THUMBNAIL = { width: 120, height: 80 };

export class Panel {
    /** @param {Editor} editor */
    constructor(editor) {
        this.editor = editor;
        /** What each part showed last, to leave alone what is the same: @type {Map<string, string>} */
        this.shown = new Map();
        this.values = new Values(editor);
        /** @type {HTMLSelectElement} */ (byId('after-drawing')).addEventListener('change', (event) => {
            const { value } = /** @type {HTMLSelectElement} */ (event.target);
            editor.setAfterDrawing(/** @type {import('./types').Direction} */ (value));
        });
        byId('target-label').addEventListener('change', (event) => {
            void edits.setLabel(editor, /** @type {HTMLSelectElement} */ (event.target).value);
        });
        for (const flag of /** @type {const} */ (['occluded', 'truncated'])) {
            byId(`flag-${flag}`).addEventListener('change', () => void edits.toggleFlag(editor, flag));
        }
        byId('hide-apply').addEventListener('click', () => this.#hide());
        byId('gap-continue').addEventListener('click', () => void edits.continueTracking(editor));
        byId('attributes').addEventListener('click', () => void openAttributes(editor));
        byId('reject-proposals').addEventListener('click', () =>
            reject(editor, editor.proposals.of(editor.clip)),
        );
        byId('proposals-score').addEventListener('input', (event) => {
            const { valueAsNumber } = /** @type {HTMLInputElement} */ (event.target);
            setLeastScore(editor, valueAsNumber);
        });
    }

    /**
     * Draws a part of the panel if what it shows has changed.
     * @param {string} part
     * @param {unknown} state
     * @param {() => void} draw
     */
    #update(part, state, draw) {
        const text = JSON.stringify(state);
        if (this.shown.get(part) === text) return;
        this.shown.set(part, text);
        draw();
    }

    render() {
        const { editor } = this;
        const { clip, track } = editor;
        const labels = clip?.project.labels ?? [];
        const targets = (clip?.tracks ?? []).map(({ target, keys }) => [
            target.id,
            target.label,
            keys.length,
            editor.unseen.has(target.id),
        ]);
        const at = editor.frame;
        const states = (clip?.tracks ?? []).map((each) => inWords(each.at(at)));
        const list = [clip?.info.id, targets, editor.selected, labels];
        this.#update('targets', list, () => this.#renderTargets());
        // New rows have no state yet.
        this.#update('states', [states, list], () => this.#renderStates(states));
        this.#update('labels', [labels, track?.target.label ?? editor.label, track === null], () =>
            this.#renderLabels(),
        );
        this.#renderTarget();
        this.#renderProposals();
        this.#update('remarks', [clip?.info.id, clip?.project.remarks, targets], () => renderRemarks(editor));
        const doubts = clip?.doubts.slice(0, DOUBTS_SHOWN) ?? [];
        this.#update(
            'doubts',
            [
                clip?.info.id,
                doubts,
                clip?.doubts.length,
                editor.doubt,
                targets.length,
                clip?.left,
                clip?.isBusy,
            ],
            () => this.#renderDoubts(doubts),
        );
        this.#update(
            'look',
            [editor.looking, editor.look, editor.selected, at],
            () => void this.#renderLook(),
        );
        /** @type {HTMLSelectElement} */ (byId('after-drawing')).value = editor.afterDrawing;
    }

    #renderTargets() {
        const { editor } = this;
        const { clip } = editor;
        const rows = (clip?.tracks ?? []).map(({ target: { id, label } }) => {
            const swatch = element('span', { class: 'swatch' });
            swatch.style.background = clip?.colour(id) ?? '';
            const unseen = editor.unseen.has(id);
            const select = element(
                'button',
                {
                    class: 'target-name',
                    attributes: { type: 'button', 'aria-pressed': String(id === editor.selected) },
                    on: { click: () => edits.choose(editor, id) },
                },
                swatch,
                element('span', { class: 'name', text: label }),
                element('span', { class: 'id', text: String(id) }),
                element('span', { class: 'state', attributes: { 'data-state': id } }),
            );
            const name = `${unseen ? 'Show' : 'Do not show'} ${label} ${id}`;
            const eye = iconButton(unseen ? 'unseen' : 'eye', name, () => editor.toggleSeen(id));
            return element(
                'li',
                { class: id === editor.selected ? 'target selected' : 'target' },
                select,
                eye,
            );
        });
        byId('targets').replaceChildren(...rows);
        byId('targets-empty').hidden = rows.length > 0;
        byId('targets-count').textContent = rows.length ? String(rows.length) : '';
        byId('targets').querySelector('.selected')?.scrollIntoView({ block: 'nearest' });
    }

    /** @param {string[]} states */
    #renderStates(states) {
        const marks = byId('targets').querySelectorAll('[data-state]');
        marks.forEach((mark, at) => {
            mark.textContent = states[at] ?? '';
            mark.setAttribute('data-kind', (states[at] ?? '').split(' ')[0] ?? '');
        });
    }

    #renderLabels() {
        const { editor } = this;
        const labels = editor.clip?.project.labels ?? [];
        const select = /** @type {HTMLSelectElement} */ (byId('target-label'));
        const value = editor.track?.target.label ?? editor.label ?? '';
        select.replaceChildren(
            ...labels.map(({ name }, at) =>
                element('option', {
                    text: at < 9 ? `${at + 1}  ${name}` : name,
                    attributes: { value: name },
                }),
            ),
        );
        if (labels.length === 0)
            select.append(element('option', { text: 'object', attributes: { value: 'object' } }));
        select.value = value;
        byId('target-label-name').textContent = editor.track ? 'Label' : 'Label of new boxes';
    }

    #renderTarget() {
        const { editor } = this;
        const { track, clip } = editor;
        const seen = track?.at(editor.frame) ?? null;
        const stretch = track?.hiddenAt(editor.frame) ?? null;
        byId('target-part').hidden = !track;
        this.values.render();
        byId('target-title').textContent = track ? `${track.target.label} ${track.target.id}` : '';
        if (track && seen) {
            const covered =
                `${counted(track.keys.length, 'key frame')}, ` + `${percent(track.coverage())} % of the clip`;
            byId('target-summary').textContent = covered;
            this.#renderGap(track);
            for (const flag of /** @type {const} */ (['occluded', 'truncated'])) {
                const box = /** @type {HTMLInputElement} */ (byId(`flag-${flag}`));
                box.checked = seen[flag];
                box.disabled = !seen.box;
            }
            byId('key-button').textContent = seen.kind === 'key' ? 'Remove key frame' : 'Make key frame';
            byId('key-button').toggleAttribute('disabled', !seen.box);
            byId('visible-button').hidden = !stretch && !track.isDoubtful(editor.frame);
            const while_ = seen.kind === 'lost' ? 'lost' : 'doubtful';
            byId('visible-button').textContent = stretch
                ? 'Visible after all'
                : `Not visible while ${while_}`;
            byId('hidden-button').hidden = Boolean(stretch);
        }
        byId('stretch').hidden = editor.stretch === null;
        if (editor.stretch) {
            const { from, to } = editor.stretch;
            byId('stretch-text').textContent = `Frames ${from} to ${to} are marked.`;
        }
        byId('hiding').hidden = editor.hiddenFrom === null;
        if (editor.hiddenFrom !== null) {
            byId('hiding-text').textContent =
                `Not visible from frame ${editor.hiddenFrom}. Go to the last such ` +
                'frame and press H again, or give it here:';
            /** @type {HTMLInputElement} */ (byId('hide-to')).max = String(Math.max(0, editor.count - 1));
            this.#update('hiding', [editor.frame, editor.hiddenFrom], () => {
                /** @type {HTMLInputElement} */ (byId('hide-to')).value = String(editor.frame);
            });
        }
        byId('stop-button').hidden = !clip?.job;
    }

    /**
     * Frames about which nothing is known are offered to be tracked.
     * @param {import('./tracks.mjs').Track} track
     */
    #renderGap(track) {
        const gap = this.editor.clip?.job ? null : track.gap();
        byId('gap-part').hidden = !gap;
        if (!gap) return;
        const share = Math.max(1, percent(track.unknown() / Math.max(1, track.frames)));
        byId('gap-text').textContent =
            `${share} % of the clip is not tracked: frames ${gap.from} to ${gap.to}` +
            `${gap.more ? ' and others' : ''}.`;
    }

    #renderProposals() {
        const { clip, frame, proposals, proposal } = this.editor;
        const [all, below] = [proposals.of(clip).length, proposals.belowLeastScore(clip)];
        byId('proposals-part').hidden = all + below === 0;
        byId('proposals-count').textContent = String(all);
        const here = proposals.in(clip, frame).length;
        const text = here
            ? `In this frame: ${here}. A click on one accepts it.`
            : 'None in this frame; squares above the timeline mark those with some.';
        byId('proposals-text').textContent = below ? `${text} ${below} with a lower score.` : text;
        byId('reject-proposal').toggleAttribute('disabled', !proposal);
    }

    #hide() {
        const to = /** @type {HTMLInputElement} */ (byId('hide-to')).valueAsNumber;
        const from = this.editor.hiddenFrom;
        if (from === null || !Number.isInteger(to)) return;
        void stretches.hide(this.editor, Math.min(from, to), Math.max(from, to));
    }

    /** @param {import('./types').ReviewSuggestion[]} doubts */
    #renderDoubts(doubts) {
        const { editor } = this;
        const { clip } = editor;
        const all = clip?.doubts.length ?? 0;
        byId('doubts-count').textContent = all ? String(all) : '';
        byId('doubts-empty').hidden = doubts.length > 0;
        byId('doubts-empty').textContent = whatIsLeft(clip);
        byId('doubts-left-text').textContent = clip ? inNumbers(clip.left) : '';
        byId('doubts').replaceChildren(...doubts.map((doubt) => this.#doubt(doubt)));
        byId('doubts').querySelector('[aria-current]')?.scrollIntoView({ block: 'nearest' });
    }

    /** @param {import('./types').ReviewSuggestion} doubt */
    #doubt(doubt) {
        const { editor } = this;
        const track = editor.clip?.track(doubt.target);
        const picture = element('span', { class: 'doubt-picture' });
        const box = track?.at(doubt.frame).box;
        if (editor.clip) {
            // Of a frame without a box all is shown.
            const cut = box ? { box, frameWidth: editor.clip.info.width } : undefined;
            thumbnails.show(picture, { path: editor.clip.path, frame: doubt.frame, size: THUMBNAIL, cut });
        }
        const current = editor.doubt?.target === doubt.target && editor.doubt.frame === doubt.frame;
        const gain = Math.round(doubt.gain);
        const help = gain >= 1 ? `A correction here helps about ${counted(gain, 'frame')}.` : '';
        return element(
            'li',
            {},
            element(
                'button',
                {
                    class: 'doubt',
                    attributes: { type: 'button', title: help, 'aria-current': current ? 'true' : null },
                    on: { click: () => editor.showDoubt(doubt) },
                },
                picture,
                element(
                    'span',
                    { class: 'doubt-words' },
                    element('span', {
                        class: 'doubt-where',
                        text: `${track?.target.label ?? ''} ${doubt.target} · frame ${doubt.frame}`,
                    }),
                    element('span', { class: 'doubt-why', text: doubt.reason }),
                ),
            ),
        );
    }

    async #renderLook() {
        const { editor } = this;
        byId('look-part').hidden = !editor.looking;
        const words = byId('look-words');
        const pictures = byId('look-pictures');
        if (!editor.looking) return;
        const { look, clip, frame } = editor;
        pictures.replaceChildren();
        if (!editor.track) words.textContent = 'Select a target.';
        else if (!editor.track.at(frame).box) words.textContent = 'There is no box in this frame.';
        else if (!look) words.textContent = 'Looking …';
        else words.textContent = look.words.join(', ') || 'Nothing unusual.';
        const box = asBox(look?.box ?? null);
        if (!look || !box || !clip) return;
        const size = { width: 120, height: Math.round(Math.min(160, Math.max(40, (120 * box.h) / box.w))) };
        const picture = await thumbnails
            .get({ path: clip.path, frame, size, cut: { box, frameWidth: clip.info.width } })
            .catch(() => null);
        if (!picture || look !== editor.look) return;
        pictures.replaceChildren(...look.scales.map((scale) => withHidden(picture, box, scale)));
    }
}

/**
 * What to do where no place is doubtful.
 * @param {import('./clip.mjs').Clip | null} clip
 */
function whatIsLeft(clip) {
    if (!clip?.tracks.length)
        return 'Where the tracker is not sure, the places are shown here, the most useful first.';
    if (clip.isBusy) return 'Tracking: places that are worth a look are shown when it has ended.';
    return 'No place is left that is worth a look. Play the clip once, then export it.';
}

/** @param {number} share */
function percent(share) {
    return Math.round(100 * share);
}

/**
 * The target with its patches at one scale.
 * @param {HTMLCanvasElement} picture with the target in its middle
 * @param {import('./types').Box} box
 * @param {{columns: number, rows: number, hidden: number[]}} scale
 */
function withHidden(picture, box, scale) {
    const canvas = copy(picture);
    const context = canvas.getContext('2d');
    // As thumbnails are cut: 1.8 times the box, with the same shape.
    const [w, h] = [canvas.width / 1.8, ((canvas.width / 1.8) * box.h) / box.w];
    if (context) drawHidden(context, { x: (canvas.width - w) / 2, y: (canvas.height - h) / 2, w, h }, scale);
    const share = scale.hidden.reduce((sum, value) => sum + value, 0) / Math.max(1, scale.hidden.length);
    const text = `${scale.columns} × ${scale.rows} patches: hidden ${Math.round(100 * share)} %`;
    return element('figure', {}, canvas, element('figcaption', { text }));
}

/**
 * The list of labels: names, colours, new ones.
 * @param {Editor} editor
 */
export function openLabels(editor) {
    const { clip } = editor;
    if (!clip) return;
    const list = element('ul', { class: 'label-rows' });
    const draw = () =>
        list.replaceChildren(
            ...clip.project.labels.map(({ name, colour }, at) => {
                const pick = element('input', {
                    attributes: { type: 'color', value: colour, 'aria-label': `Colour of ${name}` },
                });
                pick.addEventListener(
                    'change',
                    () => void clip.edit([{ edit: 'set_label', name, colour: pick.value }]),
                );
                const text = element('input', {
                    attributes: { value: name, 'aria-label': `Name of label ${at + 1}`, maxlength: 100 },
                });
                text.addEventListener('change', () => {
                    if (text.value.trim())
                        void clip.edit([{ edit: 'set_label', name, new_name: text.value.trim() }]);
                });
                const schema = iconButton('attributes', `Attributes of ${name}`, () =>
                    openSchema(editor, name),
                );
                const remove = iconButton(
                    'delete',
                    `Remove ${name}`,
                    () => void edits.removeLabel(editor, name),
                );
                return element(
                    'li',
                    {},
                    element('kbd', { text: at < 9 ? String(at + 1) : '' }),
                    pick,
                    text,
                    schema,
                    remove,
                );
            }),
        );
    draw();
    const drawAgain = () => {
        // A name that is being typed stays.
        const typed = list.querySelector('input:focus');
        if (!(typed instanceof HTMLInputElement) || typed.value === typed.defaultValue) draw();
    };
    clip.addEventListener('loaded', drawAgain);
    const name = element('input', {
        attributes: { placeholder: 'New label', 'aria-label': 'New label', maxlength: 100, autofocus: true },
    });
    const add = async (/** @type {Event} */ event) => {
        event.preventDefault();
        const text = name.value.trim();
        // The project chooses a colour that is not in use.
        if (!text || !(await clip.edit([{ edit: 'add_label', name: text }]))) return;
        editor.label = text;
        name.value = '';
        name.focus();
    };
    const button = element('button', { class: 'primary', text: 'Add', attributes: { type: 'submit' } });
    const form = element('form', { class: 'label-new', on: { submit: add } }, name, button);
    const hint = element('p', {
        class: 'hint',
        text:
            'The labels are those of all clips, and their order is that of the classes in exports. What is ' +
            'changed here is not undone with Ctrl+Z.',
    });
    openDialog('Labels', [hint, list, form], {
        onClose: () => clip.removeEventListener('loaded', drawAgain),
    });
}
