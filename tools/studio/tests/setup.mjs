// The clip of all tests is rendered, and tracked once, by the program itself.

import { execFileSync } from 'node:child_process';
import { copyFileSync, mkdirSync, rmSync } from 'node:fs';
import path from 'node:path';
import { demo, program, readTruth, scratch } from './program.mjs';

export default function setup() {
    rmSync(scratch, { recursive: true, force: true });
    mkdirSync(scratch, { recursive: true });
    execFileSync(program, ['demo', '--quiet', '--out', demo], { stdio: 'pipe' });
    copyFileSync(path.join(demo, 'input.mp4'), path.join(demo, 'clip.mp4'));
    const [{ x, y, w, h }] = readTruth();
    const options = ['--box', `${x},${y},${w},${h}`, '--project', 'clip.patchlock.json', '--quiet'];
    execFileSync(program, ['track', 'clip.mp4', ...options], { cwd: demo, stdio: 'pipe' });
}
