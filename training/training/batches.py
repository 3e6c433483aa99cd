"""Batches of pairs, made by processes of their own, in an order that does not depend on them."""

import multiprocessing
import os

import numpy as np
import torch

from . import pairs, store
from .geometry import SEARCH, TEMPLATE

SLOTS = 24


class Batches:
    """The batches from number `first` on. Batch `n` holds the pairs from `n * size` on."""

    def __init__(self, work, seed, size, first, workers):
        self.size, self.next = size, first
        self.templates = shared(SLOTS, size, TEMPLATE, TEMPLATE, 3)
        self.windows = shared(SLOTS, size, SEARCH, SEARCH, 3)
        self.boxes = torch.zeros(SLOTS, size, 4).share_memory_()
        context = multiprocessing.get_context("spawn")
        self.free = [context.Semaphore(1) for _ in range(SLOTS)]
        self.ready = [context.Semaphore(0) for _ in range(SLOTS)]
        rings = (self.templates, self.windows, self.boxes, self.free, self.ready)
        self.workers = [
            context.Process(
                target=fill, args=(work, seed, size, first + k, workers, rings), daemon=True
            )
            for k in range(workers)
        ]
        for worker in self.workers:
            worker.start()

    def take(self):
        """The next batch: templates, windows, boxes."""
        slot = self.next % SLOTS
        while not self.ready[slot].acquire(timeout=5):
            if not all(worker.is_alive() for worker in self.workers):
                raise RuntimeError("a process that makes pairs has ended; its error is above")
        batch = [ring[slot].clone() for ring in (self.templates, self.windows, self.boxes)]
        self.free[slot].release()
        self.next += 1
        return batch

    def close(self):
        for worker in self.workers:
            worker.terminate()


def shared(*shape):
    return torch.zeros(*shape, dtype=torch.uint8).share_memory_()


def fill(work, seed, size, number, step, rings):
    """Makes each `step`-th batch from `number` on, until the trainer is gone."""
    torch.set_num_threads(1)
    pairs.single_threaded()
    things = store.load(work)
    templates, windows, boxes, free, ready = rings
    while True:
        slot = number % SLOTS
        while not free[slot].acquire(timeout=5):
            if os.getppid() == 1:
                return
        for k in range(size):
            pair = pairs.make(things, seed, number * size + k)
            templates[slot, k] = torch.from_numpy(pair.template)
            windows[slot, k] = torch.from_numpy(pair.window)
            boxes[slot, k] = torch.from_numpy(np.asarray(pair.box, np.float32))
        ready[slot].release()
        number += step
