//! Encoded frames in memory, the least recently used of which is dropped first.

use std::sync::Mutex;

use axum::body::Bytes;
use lru::LruCache;

use super::lock;

/// Bytes of encoded frames kept, of all clips together.
const CACHE_BYTES: usize = 256 << 20;

/// An encoded frame of a clip; width 0 stands for the frame's own width.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Key {
    pub(super) clip: usize,
    pub(super) frame: usize,
    pub(super) width: u32,
}

/// Encoded frames of all clips. It holds a number of bytes, not of frames.
pub struct Cache {
    most: usize,
    held: Mutex<CacheState>,
}

struct CacheState {
    frames: LruCache<Key, Bytes>,
    bytes: usize,
}

impl Default for Cache {
    fn default() -> Self {
        Self::new(CACHE_BYTES)
    }
}

impl Cache {
    fn new(most: usize) -> Self {
        Self { most, held: Mutex::new(CacheState { frames: LruCache::unbounded(), bytes: 0 }) }
    }

    pub(super) fn get(&self, key: Key) -> Option<Bytes> {
        lock(&self.held).frames.get(&key).cloned()
    }

    /// Whether it holds a frame. This is no use of the frame.
    pub(super) fn holds(&self, key: Key) -> bool {
        lock(&self.held).frames.contains(&key)
    }

    pub(super) fn put(&self, key: Key, jpeg: Bytes) {
        let mut held = lock(&self.held);
        held.bytes += jpeg.len();
        if let Some(old) = held.frames.put(key, jpeg) {
            held.bytes -= old.len();
        }
        while held.bytes > self.most {
            let Some((_, oldest)) = held.frames.pop_lru() else { return };
            held.bytes -= oldest.len();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(frame: usize) -> Key {
        Key { clip: 1, frame, width: 0 }
    }

    #[test]
    fn the_cache_holds_no_more_bytes_than_it_may_and_keeps_what_was_used_last() {
        let cache = Cache::new(1000);
        for frame in 0..100 {
            cache.put(key(frame), Bytes::from(vec![0; 100]));
            // The first one is looked at again and again.
            assert!(cache.get(key(0)).is_some(), "{frame}");
            assert!(lock(&cache.held).bytes <= 1000);
        }
        let kept: Vec<usize> = (0..100).filter(|&frame| cache.holds(key(frame))).collect();
        assert_eq!(kept, [0, 91, 92, 93, 94, 95, 96, 97, 98, 99]);
        cache.put(key(99), Bytes::from(vec![0; 50]));
        let held = lock(&cache.held);
        assert_eq!((held.bytes, held.frames.len()), (950, 10));
    }
}
