//! A committee: two trackers that follow the same target independently, and one estimate made of
//! theirs. No member ever learns what the other one says, so that they make different mistakes.

mod consensus;

use crate::estimate::Estimate;
use crate::methods::{CommitteeView, DynTracker, FrameView, MemberView, Observer, SavedTarget};
use crate::network_error::NetworkError;
use crate::numeric::parallel::*;
use crate::robust::RobustConfig;
use crate::target_tracker::{Input, Scratch};
use crate::vision::frame::Frame;
use crate::vision::geometry::BoundingBox;
pub(crate) use consensus::CommitteeFit;
use consensus::{Consensus, Vote, Weights, knows_visibility};

/// A target that two trackers follow.
#[derive(Debug)]
pub(crate) struct Committee {
    members: [Member; 2],
    config: RobustConfig,
    fit: &'static CommitteeFit,
}

/// A tracker of a committee.
#[derive(Debug)]
pub(crate) struct Member {
    name: &'static str,
    tracker: Box<dyn DynTracker>,
    weights: &'static Weights,
    /// What it says of the current frame. No frame depends on it.
    estimate: Estimate,
}

impl Committee {
    /// A committee of these members, which have begun on the same target.
    pub fn new(members: [Member; 2], config: &RobustConfig, fit: &'static CommitteeFit) -> Self {
        Self { members, config: config.clone(), fit }
    }

    /// Has both members find the target, at the same time if nobody observes them.
    fn update_members(
        &mut self,
        input: Input<'_>,
        scratches: &mut [Scratch; 2],
        observer: &mut Option<&mut dyn Observer>,
    ) -> Result<(), NetworkError> {
        let Some(observer) = observer else {
            return self.members.par_iter_mut().zip(scratches).try_for_each(|(member, scratch)| {
                member.tracker.update(input, scratch, None, &mut member.estimate)
            });
        };
        for (member, scratch) in self.members.iter_mut().zip(scratches) {
            member.tracker.update(input, scratch, Some(&mut **observer), &mut member.estimate)?;
        }
        Ok(())
    }

    /// What members say of their own places and, where they disagree, of that of the other.
    fn votes(
        &self,
        input: Input<'_>,
        scratches: &mut [Scratch; 2],
    ) -> Result<[Vote; 2], NetworkError> {
        let Self { members, config, .. } = self;
        let boxes = members.each_ref().map(|member| member.estimate.bbox);
        let mut votes =
            members.each_ref().map(|member| Vote::own(&member.estimate, member.weights));
        if boxes[0].overlap(&boxes[1]) > config.agree_overlap {
            return Ok(votes);
        }
        for ((judge, scratch), place) in members.iter().zip(scratches).zip([1, 0]) {
            if let Some(log_odds) = judge.tracker.log_odds_at(input.frame, boxes[place], scratch)? {
                votes[place].add_judgement(log_odds, judge.weights);
            }
        }
        Ok(votes)
    }

    /// Makes the estimate of those of the members.
    fn fill(&mut self, consensus: Consensus, out: &mut Estimate) {
        let Self { members, config, .. } = self;
        let shape = consensus.group.clone().find(|&k| members[k].estimate.visibility.is_some());
        let shape = shape.unwrap_or(consensus.leader);
        out.corners = members[shape].estimate.outline_in(consensus.bbox);
        // The estimate of the member is filled again on the next frame.
        std::mem::swap(&mut out.visibility, &mut members[shape].estimate.visibility);
        (out.bbox, out.score) = (consensus.bbox, consensus.score);
        let visible = out.visibility.as_ref().map(|visibility| visibility.share());
        out.status = consensus.status(visible, config);
        if !visible.is_some_and(|share| knows_visibility(out.status, share, config)) {
            out.visibility = None;
        }
    }
}

impl DynTracker for Committee {
    fn update(
        &mut self,
        input: Input<'_>,
        scratch: &mut Scratch,
        mut observer: Option<&mut dyn Observer>,
        estimate: &mut Estimate,
    ) -> Result<(), NetworkError> {
        // The buffers of each member.
        let scratches: &mut [Scratch; 2] = scratch.of();
        self.update_members(input, scratches, &mut observer)?;
        let votes = self.votes(input, scratches)?;
        let consensus = Consensus::of(&votes, self.config.agree_overlap, self.fit);
        if let Some(observer) = observer {
            let members = self.members.iter().enumerate().map(|(k, member)| MemberView {
                name: member.name,
                estimate: Estimate { visibility: None, ..member.estimate.clone() },
                judgement: votes[k].judgement,
                is_believed: consensus.group.contains(&k),
            });
            let (members, agrees) = (&*members.collect::<Vec<_>>(), consensus.agrees());
            observer.observe(&FrameView::Committee(CommitteeView { members, agrees }));
        }
        self.fill(consensus, estimate);
        Ok(())
    }

    // It is no member of another committee.
    fn log_odds_at(
        &self,
        _frame: &Frame<'_>,
        _bbox: BoundingBox,
        _scratch: &mut Scratch,
    ) -> Result<Option<f64>, NetworkError> {
        Ok(None)
    }

    fn saved(&self) -> SavedTarget {
        let members = self.members.iter().map(|member| member.tracker.saved());
        SavedTarget::Committee(members.collect())
    }
}

impl Member {
    /// A tracker that is known by this name, and what its words are worth.
    pub fn new(
        name: &'static str,
        tracker: Box<dyn DynTracker>,
        weights: &'static Weights,
    ) -> Self {
        Self { name, tracker, weights, estimate: Estimate::empty() }
    }
}
