"""Second implementation of the comparison's statistics: scipy's. Reads cases as JSON, writes its answers as JSON."""

import json
import sys

import numpy as np
from scipy import stats

answers = []
for case in json.load(sys.stdin):
    d = np.array(case["differences"])
    n = len(d)
    tail = stats.norm.cdf(-np.sqrt(n / (n - 1)) * stats.t.ppf(0.975, n - 1))
    answer = {"expanded_tail": tail}
    for name, level in (("bca", 0.95), ("expanded", 1 - 2 * tail)):
        kept = stats.bootstrap(
            (d,), np.mean, confidence_level=level, n_resamples=200_000, method="BCa",
            rng=np.random.default_rng(1), vectorized=True, batch=10_000,
        ).confidence_interval
        answer[name] = [kept.low, kept.high]
    answer["p"] = stats.permutation_test(
        (d,), np.mean, permutation_type="samples", n_resamples=np.inf, alternative="two-sided", vectorized=True
    ).pvalue
    answer["p_ranks"] = stats.permutation_test(
        (np.sign(d) * stats.rankdata(np.abs(d)),), np.mean, permutation_type="samples", n_resamples=np.inf, vectorized=True
    ).pvalue
    answer["effect"] = np.mean(d) / np.std(d, ddof=1)
    answers.append(answer)
p = json.loads(sys.argv[1])
order = np.argsort(p, kind="stable")
adjusted = np.minimum(1, np.maximum.accumulate(np.array(p)[order] * np.arange(len(p), 0, -1)))
holm = np.empty(len(p))
holm[order] = adjusted
json.dump({"cases": answers, "holm": holm.tolist()}, sys.stdout)
