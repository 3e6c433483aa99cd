import { defineConfig } from '@playwright/test';
import studio from '../studio/playwright.config.mjs';

const { args, executablePath } = studio.use.launchOptions;

export default defineConfig({
    testDir: 'tests',
    testMatch: '*.spec.mjs',
    outputDir: '../../target/web/results',
    // They end what hangs; a busy machine may take many times as long as an idle one.
    timeout: 300_000,
    expect: { timeout: 60_000 },
    globalTimeout: 1_800_000,
    maxFailures: 5,
    workers: 1,
    reporter: 'line',
    use: {
        browserName: 'chromium',
        launchOptions: { executablePath, args },
        viewport: { width: 1280, height: 900 },
        contextOptions: { reducedMotion: 'reduce' },
    },
});
