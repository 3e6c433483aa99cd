//! A committee: trackers that follow the same target independently, and one estimate made of
//! theirs. No member ever learns what another one says, so that they make different mistakes.

mod consensus;

use crate::config::RobustConfig;
use crate::estimate::Estimate;
use crate::network_error::NetworkError;
use crate::numeric::parallel::*;
use crate::observe::{CommitteeView, FrameView, MemberView, Observer};
use crate::target_tracker::{Input, Scratch, TargetTracker};
pub(crate) use consensus::CommitteeFit;
use consensus::{Consensus, ConsensusParams, Vote, Weights};

/// A target that several trackers follow.
#[derive(Debug)]
pub(crate) struct Committee {
    members: Vec<Member>,
    params: ConsensusParams,
    /// What is said of the current frame. No frame depends on it.
    votes: Vec<Vote>,
}

/// A tracker of a committee.
#[derive(Debug)]
pub(crate) struct Member {
    name: &'static str,
    tracker: Box<dyn TargetTracker>,
    weights: &'static Weights,
    /// What it says of the current frame. No frame depends on it.
    estimate: Estimate,
}

/// The buffers of each member.
#[derive(Debug, Default)]
struct MemberScratches(Vec<Scratch>);

impl Committee {
    /// A committee of these members, which have begun on the same target.
    pub fn new(members: Vec<Member>, config: &RobustConfig, fit: &'static CommitteeFit) -> Self {
        Self { members, params: ConsensusParams::new(config, fit), votes: Vec::new() }
    }

    /// Its members, in a fixed order.
    pub fn members(&self) -> impl Iterator<Item = &dyn TargetTracker> {
        self.members.iter().map(|member| &*member.tracker)
    }

    /// Has all members find the target, at the same time if nobody observes them.
    fn update_members(
        &mut self,
        input: Input<'_>,
        scratches: &mut Vec<Scratch>,
        observer: &mut Option<&mut dyn Observer>,
    ) -> Result<(), NetworkError> {
        scratches.resize_with(self.members.len(), Scratch::default);
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

    /// Collects what members say of their own places, and of those of others that they disagree with.
    fn collect_votes(
        &mut self,
        input: Input<'_>,
        scratches: &mut [Scratch],
    ) -> Result<(), NetworkError> {
        let Self { members, params, votes } = self;
        votes.clear();
        votes.extend(members.iter().map(|member| Vote::own(&member.estimate, member.weights)));
        for (k, (judge, scratch)) in members.iter().zip(scratches).enumerate() {
            for (place, member) in members.iter().enumerate() {
                let bbox = member.estimate.bbox;
                if place == k || judge.estimate.bbox.overlap(&bbox) > params.agree_overlap {
                    continue;
                }
                if let Some(log_odds) = judge.tracker.log_odds_at(input.frame, bbox, scratch)? {
                    votes[place].add_judgement(log_odds, judge.weights);
                }
            }
        }
        Ok(())
    }

    /// Makes the estimate of those of the members.
    fn fill(&mut self, consensus: Consensus, out: &mut Estimate) {
        let Self { members, params, .. } = self;
        let shape = consensus.members().find(|&k| members[k].estimate.visibility.is_some());
        let shape = shape.unwrap_or(consensus.leader);
        out.corners = members[shape].estimate.outline_in(consensus.bbox);
        // The estimate of the member is filled again on the next frame.
        std::mem::swap(&mut out.visibility, &mut members[shape].estimate.visibility);
        (out.bbox, out.score) = (consensus.bbox, consensus.score);
        let visible = out.visibility.as_ref().map(|visibility| visibility.share());
        out.status = params.status(&consensus, visible);
        if !visible.is_some_and(|share| params.knows_visibility(out.status, share)) {
            out.visibility = None;
        }
    }
}

impl TargetTracker for Committee {
    fn update(
        &mut self,
        input: Input<'_>,
        scratch: &mut Scratch,
        mut observer: Option<&mut dyn Observer>,
        estimate: &mut Estimate,
    ) -> Result<(), NetworkError> {
        let MemberScratches(scratches) = scratch.of();
        self.update_members(input, scratches, &mut observer)?;
        self.collect_votes(input, scratches)?;
        let consensus = Consensus::of(&self.votes, &self.params);
        if let Some(observer) = observer {
            let members = self.members.iter().enumerate().map(|(k, member)| MemberView {
                name: member.name,
                estimate: Estimate { visibility: None, ..member.estimate.clone() },
                judgement: self.votes[k].judgement,
                is_believed: consensus.members().any(|number| number == k),
            });
            let (members, agrees) = (&*members.collect::<Vec<_>>(), consensus.agrees());
            observer.observe(&FrameView::Committee(CommitteeView { members, agrees }));
        }
        self.fill(consensus, estimate);
        Ok(())
    }
}

impl Member {
    /// A tracker that is known by this name, and what its words are worth.
    pub fn new(
        name: &'static str,
        tracker: Box<dyn TargetTracker>,
        weights: &'static Weights,
    ) -> Self {
        Self { name, tracker, weights, estimate: Estimate::empty() }
    }
}
