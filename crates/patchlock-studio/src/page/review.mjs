// A review pass: another person accepts targets, or says where they are wrong. What they say is in the
// project file, and goes with it.

import { byId, counted, element, iconButton, openDialog } from './dom.mjs';
import { tell } from './notices.mjs';

/** @typedef {import('./editor.mjs').Editor} Editor */
/** @typedef {import('./types').Remark} Remark */

/**
 * Says that the selected target is right in all frames.
 * @param {Editor} editor
 */
export async function accept(editor) {
    const track = editor.needTarget();
    if (!track) return;
    const { id, label } = track.target;
    const edit = { edit: 'add_remark', frame: editor.frame, target: id, verdict: 'accepted' };
    if (await editor.clip?.edit([edit])) tell(`Accepted: ${label} ${id}`);
}

/**
 * Asks what is wrong with the selected target in this frame, or without one, with the frame.
 * @param {Editor} editor
 * @param {'rejected' | 'comment'} verdict
 */
export function remark(editor, verdict) {
    const { clip, track, frame } = editor;
    if (!clip) return;
    const of = track ? `${track.target.label} ${track.target.id}` : 'the frame';
    const text = element('textarea', {
        attributes: { rows: 3, maxlength: 2000, 'aria-label': 'What is to be done', autofocus: true },
    });
    const name = verdict === 'rejected' ? 'Reject' : 'Comment';
    const form = element(
        'form',
        {
            class: 'remark-new',
            on: {
                submit: (event) => {
                    event.preventDefault();
                    dialog.close();
                    const target = track ? { target: track.target.id } : {};
                    void clip.edit([
                        { edit: 'add_remark', frame, ...target, verdict, text: text.value.trim() },
                    ]);
                },
            },
        },
        text,
        element(
            'div',
            { class: 'dialog-buttons' },
            element('button', { class: 'primary', text: name, attributes: { type: 'submit' } }),
        ),
    );
    const dialog = openDialog(`${name}: ${of}, frame ${frame}`, [form]);
}

/**
 * Shows what reviewers have said of the clip.
 * @param {Editor} editor
 */
export function renderRemarks(editor) {
    const { clip } = editor;
    const remarks = clip?.project.remarks ?? [];
    byId('review-part').hidden = !clip?.tracks.length && remarks.length === 0;
    const open = remarks.filter(({ verdict }) => verdict !== 'accepted').length;
    const accepted = remarks.length - open;
    const words = [
        accepted ? `${accepted} of ${counted(clip?.tracks.length ?? 0, 'target')} accepted` : '',
        open ? `${open} to see to` : '',
    ];
    byId('review-count').textContent = words.filter(Boolean).join(', ');
    byId('remarks').replaceChildren(...remarks.map((remark) => row(editor, remark)));
}

/**
 * @param {Editor} editor
 * @param {Remark} remark
 */
function row(editor, { id, frame, target, verdict, text }) {
    const of = target === undefined ? 'Frame' : `${editor.clip?.track(target)?.target.label ?? ''} ${target}`;
    const where = verdict === 'accepted' ? of : `${of} · frame ${frame}`;
    const go = () => {
        if (target !== undefined) editor.select(target);
        editor.goTo(frame);
    };
    const done = verdict === 'accepted' ? 'Take back' : 'This is seen to: remove it';
    return element(
        'li',
        { class: `remark ${verdict}` },
        element(
            'button',
            { class: 'remark-words', attributes: { type: 'button' }, on: { click: go } },
            element('span', { class: 'remark-where', text: `${where}: ${verdict}` }),
            text ? element('span', { class: 'remark-text', text }) : '',
        ),
        iconButton('done', done, () => void editor.clip?.edit([{ edit: 'remove_remark', id }])),
    );
}
