"""Depth of the reference camera by OpenCV's semi-global matching: rectified pairs with it, median of depths.

usage: python opencv_sgbm.py DATASET ANSWER [--block N]

Reads a folder that `strandbench dataset export` wrote and writes depth.npy.
"""
import argparse

import cv2
import numpy as np

import dataset


def pair_depth(pair, block):
    """NaN where the matcher has no answer."""
    low = int(np.floor(pair.low)) - 1
    count = int(np.ceil((pair.high - low) / 16 + 1) * 16)
    matcher = cv2.StereoSGBM_create(
        minDisparity=low, numDisparities=count, blockSize=block, P1=8 * block * block, P2=32 * block * block,
        disp12MaxDiff=2, uniquenessRatio=5, speckleWindowSize=100, speckleRange=2, mode=cv2.STEREO_SGBM_MODE_HH)
    disparity = matcher.compute(pair.a, pair.b).astype(np.float32) / 16.0
    disparity[disparity <= low] = np.nan
    return pair.depth(disparity)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset")
    parser.add_argument("answer")
    parser.add_argument("--block", type=int, default=9)
    args = parser.parse_args()
    cv2.setNumThreads(1)
    dataset.answer(args.dataset, args.answer, lambda pair: pair_depth(pair, args.block))


if __name__ == "__main__":
    main()
