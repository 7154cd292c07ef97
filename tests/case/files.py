"""Case files as text: one with every key, and a short one."""

from pathlib import Path

PATH = Path("family/c.yaml")
FULL = """\
name: ssnp170-c
title: A title
description: What it shows.
mesh: {file: meshes/c.med}
transform: {scale: 2.0}
plane: strain
materials:
  lower: {young: 2000, poisson: 0.3}
  upper: {young: 1e3, poisson: -0.5}
supports:
  - {group: Sym, fix: [x]}
  - {group: Base, fix: {y: 0.0, x: 1e-3*x}}
  - {group: Slope, fix: [normal]}
loads:
  - {group: Top, pressure: 25}
  - {group: Side, traction: [0.0, 2*y]}
  - {group: all, body_force: [0, -1]}
bodies: {die: {rigid: true}, soft: {rigid: false}}
contact:
  - name: interface
    slave: S
    master: M
    hexahedra: hexahedra
    treatment: lac
    normal: element
    interference: 1
  - {name: second, slave: S2, master: M2}
directions: first
steps: [0.5, 1]
observe: [{zone: interface, nearest: [25, 0]}]
reference:
  kind: analytical
  solution: {name: hydrostatic, pressure: 25, material: lower}
  contact_pressure: 25
  gap: x*0
  displacement: [0.0, -0.1*y]
  stress: {yy: -25, zz: -7.5*x/x}
tolerance: {multiplier: 1e-6}
counts: {lower: {cells: 144, faces: 12}}
"""
MINIMAL = """\
name: block
mesh: {recipe: blocks, size: 1.0}
materials: {all: {young: 1.0, poisson: 0.0}}
supports: [{group: base, fix: [x, y, z]}]
"""
