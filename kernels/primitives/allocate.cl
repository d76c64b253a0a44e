/* Processor allocation and compaction (Drucker & Schroeder, section 1.3.2; Blelloch 1990, section 1.6): both are what
 * follows a scan (scan.cl). */
#include "shared/group.cl"
#include "shared/rows.cl"

/* ---- owner and rank of every slot --------------------------------------------------------------------------------
 * offsets holds n + 1 ascending values, the last is `total`. Slot s belongs to the requester i with
 * offsets[i] <= s < offsets[i + 1]. */

/* One work-item takes `share` steps of the walk that passes all slots and all requesters in order (merge path: Odeh,
 * Green, Mwassi, Shmueli & Birk 2012), so neither a requester with a million slots nor a million requesters with none
 * fall to one work-item. Requester i is passed at step offsets[i + 1] + i. */
kernel void allocate_owners_blocks(global const uint* offsets, uint n, uint total, uint share, global uint* owner,
                                   global uint* rank) {
  const ulong steps = (ulong)n + total;
  ulong step = get_global_id(0) * share;
  if (step >= steps) return;
  const ulong last_step = min(step + share, steps);
  uint i = 0, high = n;
  while (i < high) {
    const uint mid = i + (high - i) / 2;
    if ((ulong)offsets[mid + 1] + mid < step)
      i = mid + 1;
    else
      high = mid;
  }
  ulong slot = step - i;
  /* Slots that this work-item may write: those of its steps. */
  uint below = i;
  high = n;
  while (below < high) {
    const uint mid = below + (high - below) / 2;
    if ((ulong)offsets[mid + 1] + mid < last_step)
      below = mid + 1;
    else
      high = mid;
  }
  const ulong last_slot = last_step - below;
  for (; slot < last_slot; ++i) {
    const uint begin = offsets[i];
    const ulong end = min((ulong)offsets[i + 1], last_slot);
    uint16 r = LANES + (uint)(slot - begin);
    /* Whole rows, also over slots of later requesters: these are written after. */
    for (; slot < end && slot + ROW <= last_slot; slot += ROW) {
      vstore16((uint16)i, 0, owner + slot);
      vstore16(r, 0, rank + slot);
      r += ROW;
    }
    for (; slot < end; ++slot) {
      owner[slot] = i;
      rank[slot] = (uint)(slot - begin);
    }
    slot = end;
  }
}

/* One work-item a slot. */
kernel ONE_GROUP void allocate_owners_trees(global const uint* offsets, uint n, uint total, global uint* owner,
                                            global uint* rank) {
  const uint slot = get_global_id(0);
  if (get_global_id(0) >= total) return;
  uint low = 0, high = n; /* the last requester whose offset is <= slot lies in [low, high) */
  while (high - low > 1) {
    const uint mid = low + (high - low) / 2;
    if (offsets[mid] <= slot)
      low = mid;
    else
      high = mid;
  }
  owner[slot] = low;
  rank[slot] = slot - offsets[low];
}

/* ---- indices of the flagged, ascending ---------------------------------------------------------------------------- */

/* [begin, end) of flags to indices[at .. last). Every flag writes its index and only the set ones move on; nothing is
 * written at `last`, which is the next block's. */
static inline void block_compact(global const uint* flags, global uint* indices, ulong begin, ulong end, ulong at, ulong last) {
  ulong i = begin;
  for (; i + ROW <= end && at + ROW <= last; i += ROW) {
    const int16 set = vload16(0, flags + i) != 0u;
    if (!ANY(set)) continue;
    if (!ANY(~set)) {
      vstore16(LANES + (uint)i, 0, indices + at);
      at += ROW;
      continue;
    }
    for (uint k = 0; k < ROW; ++k) {
      indices[at] = (uint)i + k;
      at += flags[i + k] != 0u;
    }
  }
  for (; at < last; ++i) {
    indices[at] = (uint)i;
    at += flags[i] != 0u;
  }
}

kernel void compact_blocks(global const uint* flags, ulong n, ulong length, global const ulong* sums,
                           global uint* indices) {
  const ulong block = get_global_id(0), begin = block * length;
  if (begin >= n) return;
  block_compact(flags, indices, begin, min(begin + length, n), sums[block], sums[block + 1]);
}

static inline ulong block_count(global const uint* flags, ulong end) {
  uint16 count = 0u;
  for (ulong i = 0; i < end; i += ROW) count += ones(load_row(flags, i, end));
  return row_sum_wide(convert_ulong16(count));
}

kernel void compact_short_blocks(global const uint* flags, ulong n, global ulong* sums, global uint* indices) {
  if (get_global_id(0) > 0) return;
  const ulong count = block_count(flags, n);
  block_compact(flags, indices, 0, n, 0, count);
  sums[0] = count;
}

static inline uint group_block_compact(global const uint* flags, global uint* indices, ulong begin, ulong end, uint at,
                                local uint* scratch) {
  for (ulong tile = begin; tile < end; tile += TILE) {
    const ulong i = tile + get_local_id(0) * ROW;
    const uint16 set = i < end ? ones(load_row(flags, i, end)) : (uint16)0u;
    const uint mine = row_scan(set).sf;
    uint to = group_scan(mine, scratch) - mine + at;
    if (mine > 0) {
      uint s[16];
      vstore16(set, 0, s);
      for (uint k = 0; k < ROW; ++k)
        if (s[k]) indices[to++] = (uint)i + k;
    }
    at += scratch[CLRAD_WORK_GROUP - 1];
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  return at;
}

kernel ONE_GROUP void compact_trees(global const uint* flags, ulong n, ulong length, global const ulong* sums,
                                    global uint* indices) {
  local uint scratch[CLRAD_WORK_GROUP];
  const ulong block = get_group_id(0), begin = block * length;
  group_block_compact(flags, indices, begin, min(begin + length, n), (uint)sums[block], scratch);
}

kernel ONE_GROUP void compact_short_trees(global const uint* flags, ulong n, global ulong* sums, global uint* indices) {
  local uint scratch[CLRAD_WORK_GROUP];
  const uint count = group_block_compact(flags, indices, 0, n, 0u, scratch);
  if (get_local_id(0) == 0) sums[0] = count;
}
