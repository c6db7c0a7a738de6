"""The protocol between compare_frames.py and a driver, Python's side of it. driver.h is C++'s.

A driver loads one scene, prints a line of JSON that says what it is, and then answers commands from standard input:

  frame         renders the whole image once and prints the milliseconds it took
  image FILE    writes the last frame as raw float32 RGBA, premultiplied and linear, top row first, and prints `done`

and ends with the input.
"""
import json
import os
import sys


def load_scene(path):
    """The scene, its file names made absolute."""
    with open(path) as f:
        scene = json.load(f)
    for key in ("raw", "transfer"):
        scene[key] = os.path.join(os.path.dirname(os.path.abspath(path)), scene[key])
    return scene


def serve(description, frame, image):
    """frame() returns milliseconds; image() an array [height][width][4]."""
    print(json.dumps(description), flush=True)
    for line in sys.stdin:
        command, _, argument = line.strip().partition(" ")
        if command == "frame":
            print(f"{frame():.4f}", flush=True)
        elif command == "image":
            image().astype("<f4").tofile(argument)
            print("done", flush=True)
        else:
            sys.exit(f"unknown command: {line!r}")
