"""Tests of Config: access to settings, errors, copies."""

from __future__ import annotations

import copy
import inspect
import pickle

import numpy as np
import pytest

import patchlock
from patchlock import Config


def test_settings_are_attributes_in_groups():
    config = Config()
    assert config.seed == 0
    config.seed = np.int64(3)
    config.robust.search = 7
    config.robust.patches.templates = 8
    assert (config.seed, config.robust.search, config.robust.patches.templates) == (3, 7.0, 8)
    group = config.robust
    group.rotate = False
    assert config.robust.rotate is False, "a group is a view"
    paper = Config("paper")
    paper.paper.gamma = "one"
    assert paper.paper.gamma == "one" and paper.paper.particles == 650


def test_every_setting_of_the_table_has_its_default():
    for parameter in patchlock.parameters(research=True):
        config = Config(parameter.group if parameter.group in patchlock.PRESETS else "robust")
        if parameter.group == "":
            place = config
        elif parameter.group == "patches":
            place = config.robust.patches
        else:
            place = getattr(config, parameter.group)
        assert getattr(place, parameter.name) == parameter.default, parameter.name
        assert parameter.name in dir(place)
        setattr(place, parameter.name, parameter.default)
        assert parameter.allowed and parameter.source and parameter.purpose


@pytest.mark.parametrize(
    ("change", "error", "says"),
    [
        ("config.robust.serch = 9", AttributeError, "no setting 'serch'; did you mean search"),
        ("config.robust.serch", AttributeError, "did you mean search"),
        ("config.search", AttributeError, r"in another group: config\.robust\.search"),
        ("config.robust.templates = 9", AttributeError, r"config\.robust\.patches\.templates"),
        ("config.robust.seed", AttributeError, r"in another group: config\.seed"),
        ("config.paper", AttributeError, r'start from patchlock\.Config\("paper"\)'),
        ("config.particles = 9", AttributeError, r'start from patchlock\.Config\("paper"\)'),
        ("config.robust = 3", AttributeError, "robust is a group of settings"),
        ("config.robust.search = 0", ValueError, "`search` is 0.*; allowed: "),
        ("config.robust.scale_count = 2.5", TypeError, "`scale_count` is 2.5; it takes a whole number"),
        ("config.robust.scale_count = True", TypeError, "`scale_count` is True; it takes a whole number"),
        ("config.robust.scale_count = -1", ValueError, "allowed: "),
        ("config.robust.search = 'far'", TypeError, "`search` is 'far'; it takes a number"),
        ("config.robust.search = float('nan')", ValueError, "search"),
        ("config.robust.search = None", TypeError, "`search` is None; it takes a number"),
        ("config.robust.rotate = 1", TypeError, "`rotate` is 1; it takes true or false"),
        ("paper.paper.gamma = 'two'", ValueError, "exp_visible, one, visible, exp_error"),
        ("paper.paper.gamma = 2", TypeError, "`gamma` is 2; it takes a word"),
    ],
)
def test_errors_name_the_setting_the_value_and_what_is_allowed(change, error, says):
    config, paper = Config(), Config("paper")
    with pytest.raises(error, match=says):
        exec(change)
    assert (config, paper) == (Config(), Config("paper"))


def test_settings_are_compared_copied_and_pickled():
    config = Config()
    config.seed = 4
    config.robust.trial = 3
    config.robust.patches.templates = 8
    for again in (copy.copy, copy.deepcopy, lambda c: pickle.loads(pickle.dumps(c))):
        copied = again(config)
        assert copied == config
        copied.seed = 5
        assert copied != config
    assert config.robust == config.robust
    assert config.robust != Config().robust
    assert repr(config) == "<Config 'robust', seed=4, robust.trial=3, robust.patches.templates=8, model='PatchNet'>"


def test_all_settings_as_a_dictionary():
    config = Config("paper")
    found = config.to_dict()
    assert list(found) == ["seed", "paper"]
    assert found["paper"]["particles"] == 650
    assert found["paper"]["patches"]["templates"] == config.paper.patches.templates


def test_a_tracker_copies_its_settings(film, scene):
    config = Config()
    tracker = patchlock.Tracker(film[0], scene.truth(0), config)
    config.seed = 9
    assert tracker.config == Config()
    tracker.config.seed = 9
    assert tracker.config.seed == 0


def test_settings_are_keyword_arguments(film, scene):
    box = scene.truth(0)
    config = Config()
    config.seed, config.robust.search, config.robust.rotate = 3, 7, False
    changes = {"seed": 3, "search": np.float32(7), "rotate": False}
    assert Config(**changes) == config
    assert patchlock.Tracker(film[0], box, **changes).config == config
    assert patchlock.MultiTracker(**changes).config == config
    # They change a copy of other settings.
    wide = Config(search=7)
    assert patchlock.MultiTracker(wide, seed=3, rotate=False).config == config
    assert wide == Config(search=7) != config
    assert patchlock.Tracker(film[0], box, preset="paper", particles=9).config == Config("paper", particles=9)
    expected = list(patchlock.track(film, box, config=config))
    assert list(patchlock.track(film, box, **changes)) == expected
    assert list(patchlock.track(film, box)) != expected


CALLS = {
    "Config": lambda film, **changes: Config(**changes),
    "Tracker": lambda film, **changes: patchlock.Tracker(film[0], (70, 60, 40, 30), **changes),
    "MultiTracker": lambda film, **changes: patchlock.MultiTracker(**changes),
    "track": lambda film, **changes: patchlock.track(film, (70, 60, 40, 30), **changes),
}


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize(
    ("changes", "error", "says"),
    [
        ({"serch": 9}, TypeError, "no setting 'serch'; did you mean search"),
        ({"runtme": 9}, TypeError, "no setting 'runtme'; did you mean runtime"),
        ({"search": 0}, ValueError, "`search` is 0.*; allowed: "),
        ({"search": "far"}, TypeError, "`search` is 'far'; it takes a number; allowed: "),
        ({"rotate": 1}, TypeError, "`rotate` is 1; it takes true or false"),
        ({"scale_count": 2.5}, TypeError, "`scale_count` is 2.5; it takes a whole number"),
        ({"particles": 9}, ValueError, 'no effect with the method `robust`; .*preset="paper" chooses it'),
    ],
)
def test_wrong_keyword_arguments_are_refused(film, call, changes, error, says):
    with pytest.raises(error, match=says):
        CALLS[call](film, **changes)


@pytest.mark.parametrize("name", ["thread", "channel", "confg"])
def test_a_mistyped_argument_is_recognised(film, name):
    for call in ("Tracker", "MultiTracker", "track"):
        with pytest.raises(TypeError, match=f"no setting '{name}'; did you mean .*{name[:4]}"):
            CALLS[call](film, **{name: 3})


def test_no_setting_has_the_name_of_an_argument():
    settings = {parameter.name for parameter in patchlock.parameters(research=True)}
    for function in (Config, patchlock.Tracker, patchlock.MultiTracker, patchlock.track):
        assert not settings & set(inspect.signature(function).parameters), function


@pytest.mark.parametrize("call", ["Tracker", "MultiTracker", "track"])
def test_a_preset_is_named_in_one_way(film, call):
    CALLS[call](film, preset="robust")
    for wrong in ("robust", {"seed": 3}):
        with pytest.raises(TypeError, match="config is a patchlock.Config, not .*; preset= takes the name"):
            CALLS[call](film, config=wrong)
    with pytest.raises(ValueError, match="unknown preset `best`; there are: robust, paper, network"):
        CALLS[call](film, preset="best")
    with pytest.raises(ValueError, match="config and preset are both given"):
        CALLS[call](film, config=Config(), preset="paper")
