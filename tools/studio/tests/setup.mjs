// The clip of all tests is rendered by the program itself.

import { execFileSync } from 'node:child_process';
import { mkdirSync, rmSync } from 'node:fs';
import { demo, program, scratch } from './program.mjs';

export default function setup() {
    rmSync(scratch, { recursive: true, force: true });
    mkdirSync(scratch, { recursive: true });
    execFileSync(program, ['demo', '--quiet', '--out', demo], { stdio: 'pipe' });
}
