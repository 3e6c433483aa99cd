// Labels, their colours and attributes.

import { expect, test } from './page.mjs';
import { readTruth } from './program.mjs';

const truth = readTruth();

test('labels, their colours and attributes', async ({ work, folder }) => {
    const { page } = work;
    await work.afterDrawing('none');
    await work.draw(truth[0]);
    await expect(work.targets()).toHaveCount(1);
    await page.locator('#stage').focus();
    await work.addLabel('picture');
    await page.getByLabel('Colour of picture').fill('#12ab34');
    await expect.poll(() => folder.project().labels.at(-1)).toEqual({ name: 'picture', colour: '#12ab34' });
    await work.closeDialog();

    await work.press(String(folder.project().labels.length));
    await expect.poll(() => folder.project().targets[0].label).toBe('picture');
    await work.press('o', 'u');
    await expect
        .poll(() => folder.project().targets[0].keys[0])
        .toMatchObject({ occluded: true, truncated: true });
    await page.locator('#attributes').click();
    await page.getByLabel('Name').fill('motif');
    await page.getByLabel('Value').fill('a boat');
    await page.getByRole('button', { name: 'Save' }).click();
    await expect.poll(() => folder.project().targets[0].attributes).toEqual({ motif: 'a boat' });
});

test('a label is changed for all targets that had the same', async ({ work, page, folder }) => {
    const labels = () => folder.project().targets.map(({ label }) => label);
    const line = (x) => `3 ${x} 0.5 0.1 0.1\n`;
    await work.addLabel('boat');
    await work.closeDialog();
    await work.press('Shift+I');
    const buffer = Buffer.from(line(0.2) + line(0.5) + line(0.8));
    const file = { name: 'frame_000000.txt', mimeType: 'text/plain', buffer };
    await page.getByLabel('File to import').setInputFiles([file]);
    await page.getByRole('button', { name: /^YOLO/ }).click();
    await page.getByRole('dialog').getByRole('button', { name: 'Import', exact: true }).click();
    await expect(work.targets()).toHaveCount(3);
    await work.choose(0);
    await work.press('2');
    const notices = page.locator('#notices');
    await expect(notices).toContainText('Still class 3: 2 other targets.');
    expect(labels()).toEqual(['boat', 'class 3', 'class 3']);
    await notices.getByRole('button', { name: 'Make all boat' }).click();
    await expect.poll(labels).toEqual(['boat', 'boat', 'boat']);
    // It is one step.
    await work.rest();
    await page.locator('#stage').focus();
    await work.press('Control+z');
    await expect.poll(labels).toEqual(['boat', 'class 3', 'class 3']);
});

test('attributes of a label are declared, and change from frame to frame', async ({ work, folder }) => {
    const { page } = work;
    await work.afterDrawing('none');
    await work.draw(truth[0]);
    await expect(work.targets()).toHaveCount(1);
    await page.locator('#stage').focus();

    // Everything with keys.
    await work.press('l');
    await page.getByRole('button', { name: 'Attributes of target' }).focus();
    await work.press('Enter');
    const dialog = page.getByRole('dialog').last();
    const add = dialog.getByRole('button', { name: 'Add attribute' });
    await add.focus();
    await work.press('Enter');
    await page.keyboard.type('parked');
    await add.focus();
    await work.press('Enter');
    await page.keyboard.type('light');
    const row = dialog.locator('.schema-rows > li').last();
    await row.getByLabel('Kind').selectOption('select');
    await row.getByLabel('Values, one a line').fill('off\non\n');
    await row.getByLabel('Default').fill('green');
    await dialog.getByRole('button', { name: 'Save' }).click();
    // What is refused says why, and stays to be corrected.
    await expect(page.locator('#errors')).toContainText('"light" is "green"; allowed: off, on');
    await row.getByLabel('Default').fill('');
    await row.getByLabel('Default').press('Enter');
    await expect(page.getByRole('dialog')).toHaveCount(1);
    await expect
        .poll(() => folder.project().labels[0].attributes)
        .toEqual([
            { name: 'parked', kind: 'checkbox', default: 'false', mutable: true },
            { name: 'light', kind: 'select', values: ['off', 'on'], default: 'off', mutable: true },
        ]);
    await work.closeDialog();

    // A value holds until the next change.
    const parked = page.getByLabel('parked', { exact: true });
    const light = page.getByLabel('light', { exact: true });
    const changes = () => folder.project().targets[0].changes ?? {};
    await expect(parked).not.toBeChecked();
    await work.goTo(20);
    await parked.focus();
    await work.press('Space');
    await expect.poll(changes).toEqual({ parked: { 20: 'true' } });
    await expect(parked).toBeFocused();
    await light.selectOption('on');
    await expect.poll(changes).toEqual({ parked: { 20: 'true' }, light: { 20: 'on' } });
    await work.goTo(19);
    await expect(parked).not.toBeChecked();
    await expect(light).toHaveValue('off');
    await work.goTo(60);
    await expect(parked).toBeChecked();
    await expect(page.locator('.value-row').first()).toContainText('from 20');
    await parked.uncheck();
    await expect.poll(() => changes().parked).toEqual({ 20: 'true', 60: 'false' });
    await page.getByRole('button', { name: 'Take back the change of parked' }).click();
    await expect.poll(() => changes().parked).toEqual({ 20: 'true' });
    await expect(parked).toBeChecked();
    await page.locator('#stage').focus();
    await work.press('Control+z', 'Control+z');
    await expect.poll(() => changes().parked).toEqual({ 20: 'true' });
    await expect(page.locator('#notices')).toContainText(
        'Undone: set parked of target 1 to "false" from frame 60',
    );

    // Other attributes of the target leave those alone.
    await page.locator('#attributes').click();
    await page.getByLabel('Name').fill('motif');
    await page.getByLabel('Value').fill('a boat');
    await page.getByRole('button', { name: 'Save' }).click();
    await expect.poll(() => folder.project().targets[0].attributes).toEqual({ motif: 'a boat' });
    expect(changes()).toEqual({ parked: { 20: 'true' }, light: { 20: 'on' } });
    expect(folder.project().version).toBe(3);
});
