import assert from 'node:assert/strict';
import {test} from 'node:test';

import {PageTable} from '../src/worker/page_table.js';

test('at first every row is new and every tile absent', () => {
  const table = new PageTable(5000);
  const rows = table.takeDirtyRows();
  assert.deepEqual(rows.map((r) => [r.first, r.count]), [[0, 3]]);
  assert.ok(rows[0]!.slots.every((slot) => slot === 65535));
  assert.equal(table.takeDirtyRows().length, 0);
});

test('only rows that changed are given, joined where adjacent', () => {
  const table = new PageTable(2048 * 6);
  table.takeDirtyRows();
  for (const entry of [5, 2048 * 2 + 1, 2048 * 3]) table.set(entry, 7);
  assert.deepEqual(table.takeDirtyRows().map((r) => [r.first, r.count]), [[0, 1], [2, 2]]);
  table.set(5, 7);
  assert.equal(table.takeDirtyRows().length, 0, 'the same slot again is no change');
  assert.equal(table.resident, 3);
});

test('a clear touches the rows that held something', () => {
  const table = new PageTable(2048 * 3);
  table.set(2048, 1);
  table.takeDirtyRows();
  table.clear();
  assert.deepEqual(table.takeDirtyRows().map((r) => [r.first, r.count]), [[1, 1]]);
  assert.equal(table.resident, 0);
  assert.equal(table.slot(2048), 65535);
});
