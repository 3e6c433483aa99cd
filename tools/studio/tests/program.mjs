// The program under test, and what it writes.

import { spawn } from 'node:child_process';
import { copyFileSync, existsSync, mkdirSync, mkdtempSync, readFileSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { expect } from '@playwright/test';

const root = path.resolve(import.meta.dirname, '../../..');
const target = process.env.CARGO_TARGET_DIR ?? path.join(root, 'target');

export const program = process.env.PATCHLOCK ?? path.join(target, 'release', 'patchlock');
export const scratch = path.join(root, 'target', 'studio');
export const demo = path.join(scratch, 'demo');
/** The sources of the page. */
export const sources = path.join(root, 'crates', 'patchlock-studio', 'src', 'page');
export const guide = path.join(root, 'docs');
export const pictures = path.join(guide, 'images');

/** True boxes of the demo, by frame: `{x, y, w, h, hidden}`. */
export function readTruth() {
    const [head, ...lines] = readFileSync(path.join(demo, 'truth.csv'), 'utf8').trim().split('\n');
    const names = head.split(',');
    return lines.map((line) => {
        const cells = line.split(',').map(Number);
        return Object.fromEntries(names.map((name, at) => [name, cells[at]]));
    });
}

/** Intersection over union of two boxes. */
export function overlap(a, b) {
    const shared = (from, length, other, otherLength) =>
        Math.max(0, Math.min(from + length, other + otherLength) - Math.max(from, other));
    const both = shared(a.x, a.w, b.x, b.w) * shared(a.y, a.h, b.y, b.h);
    return both / (a.w * a.h + b.w * b.h - both);
}

/** Tracked boxes by frame, from the columns of a project file. */
function byFrame(runs) {
    const boxes = runs.flatMap(({ from, x, y, w, h, score, status, agreement }) =>
        x.map((_, at) => {
            const box = { x: x[at], y: y[at], w: w[at], h: h[at] };
            return [from + at, { box, score: score[at], status: status[at], agreement: agreement?.[at] }];
        }),
    );
    return Object.fromEntries(boxes);
}

/** A folder with copies of the demo, whose target is already tracked on request. */
export class Folder {
    constructor(names = ['clip.mp4'], tracked = false) {
        mkdirSync(scratch, { recursive: true });
        this.path = mkdtempSync(path.join(scratch, 'test-'));
        this.videos = names.map((name) => path.join(this.path, name));
        for (const video of this.videos) copyFileSync(path.join(demo, 'input.mp4'), video);
        if (tracked) copyFileSync(path.join(demo, 'clip.patchlock.json'), this.#file(0));
    }

    #file(at) {
        return this.videos[at].replace(/\.mp4$/, '.patchlock.json');
    }

    /** Writes the project of the first clip. */
    write(project) {
        writeFileSync(this.#file(0), JSON.stringify(project));
    }

    /** The project of a clip, as it is on disk. The file appears with the first change. */
    project(at = 0) {
        const file = this.#file(at);
        if (!existsSync(file)) return { labels: [], targets: [] };
        const project = JSON.parse(readFileSync(file, 'utf8'));
        const targets = project.targets.map((target) => ({ ...target, tracked: byFrame(target.tracked) }));
        return { ...project, targets };
    }
}

/** A running `patchlock studio`. */
export class Studio {
    /** Starts it and waits for the address. */
    static start(videos, options = [], folder = path.dirname(videos[0])) {
        return Studio.#run(['--no-open', ...options, ...videos], folder);
    }

    /** Starts it with a desktop that writes down what it is asked to open. */
    static startWithBrowser(videos) {
        const folder = path.dirname(videos[0]);
        for (const name of ['xdg-open', 'open']) {
            writeFileSync(
                path.join(folder, name),
                '#!/bin/sh\necho "$@" > opened.part && mv opened.part opened\n',
                {
                    mode: 0o755,
                },
            );
        }
        return Studio.#run(videos, folder, { ...process.env, PATH: `${folder}:${process.env.PATH}` });
    }

    static #run(args, cwd, given = process.env) {
        const env = { ...given, XDG_STATE_HOME: path.join(cwd, 'state') };
        const child = spawn(program, ['studio', ...args], { cwd, env });
        return new Promise((resolve, reject) => {
            let said = '';
            const read = (data) => {
                said += data;
                const address = /http:\/\/\S+#\w+/.exec(said)?.[0];
                if (address) resolve(new Studio(child, address, cwd));
            };
            child.stdout.on('data', read);
            child.stderr.on('data', read);
            child.on('exit', (code) => reject(new Error(`patchlock studio ended with ${code}: ${said}`)));
        });
    }

    constructor(child, address, folder) {
        this.child = child;
        this.folder = folder;
        this.address = address;
        this.ended = new Promise((resolve) => child.on('exit', resolve));
    }

    get token() {
        return new URL(this.address).hash.slice(1);
    }

    /** The arguments of the program that opened the browser. */
    async opened() {
        const file = path.join(this.folder, 'opened');
        await expect.poll(() => existsSync(file)).toBe(true);
        return readFileSync(file, 'utf8').trim();
    }

    get port() {
        return new URL(this.address).port;
    }

    /** Ends it at once, as a crash would. */
    async kill() {
        this.child.kill('SIGKILL');
        await this.ended;
    }

    /** Asks the server, as the page does. */
    async ask(method, path, body) {
        const { origin } = new URL(this.address);
        const headers = { Authorization: `Bearer ${this.token}`, 'Content-Type': 'application/json' };
        const answer = await fetch(`${origin}/api${path}`, { method, headers, body: JSON.stringify(body) });
        return answer.json();
    }
}
