"""``a2v train``: train a model, or resume a run; each kind of model has its own command."""

from __future__ import annotations

HELP = (
    "Train a motion model (the papers' VAE or our own flow), an action classifier, the "
    "reconstruction or the body map; a run resumes where it was stopped."
)
SUBCOMMANDS = {
    "motion": "the papers' VAE",
    "flow": "our own window flow",
    "classifier": "the papers' action classifier",
    "baseline": "the systems that the papers compare with",
    "reconstruction": "the pixel-aligned networks",
    "bodymap": "places, depths and landmarks of a person's picture",
}
EXAMPLES = """examples:
  a2v train motion --dataset cmu --data ../shared/data --out runs/cmu
  a2v train flow --dataset cmu --data ../shared/data --out runs/flow --flow.code-size 192 --flow.threads 1
  a2v train motion --dataset humanact12 --data ../shared/data --out runs/lie --vae.decoder lie --iterations 20000 --threads 1
  a2v train motion --dataset humanact12 --data ../shared/data --out runs/mine --evaluator classifier.tar     with a running FID
  a2v train flow --dataset bvh --data my_actions --out runs/mine          your own: my_actions/walk/*.bvh, my_actions/jump/*.bvh...
  a2v train classifier --dataset bvh --data my_actions --out runs/classifier            what a2v evaluate measures them with
  a2v train flow --dataset humanact12 --data ../shared/data --held-out P03,P10 --out runs/unseen
  a2v train reconstruction --data studio --out runs/person          what a2v studio wrote; shape, then detail and colors
  a2v train bodymap --data ../shared/data --out runs/bodymap        makes its own views first

OUT gets a checkpoint every few minutes, log.csv and, at the end, the trained files. The same
command resumes a run that was stopped."""
