import assert from 'node:assert/strict';
import {test} from 'node:test';

import {Notices} from '../src/page/notices.js';
import {ScriptedBrowser} from './scripted_browser.js';

const browser = new ScriptedBrowser();

function place(): {textContent: string; hidden: boolean} {
  return {textContent: '', hidden: true};
}

test('what is said for a moment gives way to what is still so', async () => {
  const line = place();
  const notices = new Notices(line as unknown as HTMLElement, place() as unknown as HTMLElement);
  notices.quiet('Connection lost.');
  notices.quiet('The link is copied.', 3);
  assert.equal(line.textContent, 'The link is copied.');
  await browser.pass(3001);
  assert.deepEqual(line, {textContent: 'Connection lost.', hidden: false});
  notices.quiet('');
  notices.quiet('Connected again.', 3);
  assert.deepEqual(line, {textContent: 'Connected again.', hidden: false});
  await browser.pass(3001);
  assert.ok(line.hidden);
});

test('what is so now is said at once, and no moment that is over takes it back', async () => {
  const line = place();
  const notices = new Notices(line as unknown as HTMLElement, place() as unknown as HTMLElement);
  notices.quiet('The link is copied.', 3);
  notices.quiet('Connection lost.');
  assert.equal(line.textContent, 'Connection lost.');
  await browser.pass(5000);
  assert.deepEqual(line, {textContent: 'Connection lost.', hidden: false});
});
