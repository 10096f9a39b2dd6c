/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A device with a kbd48CNC and a plain PoNET module, PoExtBus, PWM, external outputs and
 * relays, in virtual time, for the tests of outputs beside the digital ones and of inputs
 * beside the fast ones.
 */
#ifndef TESTS_DEVICE_BUS_RIG_H
#define TESTS_DEVICE_BUS_RIG_H

#include "tests/device/world.h"

enum { KEYBOARD = 3, PLAIN = 9 }; /* PoNET modules */

extern struct world world;
extern struct sim_device *sim;

/* Requests that have left since the test began: a module's settings asked, its data sent. */
extern uint64_t searched, modules_written;
void count_bus(struct world *w, const uint8_t *p); /* as world.watch */

/* A module is plugged in. */
void module(unsigned int i, uint8_t type, uint8_t size);

/* For cmocka: all of it runs, with a commander that wants nothing yet. */
int begin(void **state);

/* The commander wants something of every output that differs from n to n; all have it. */
void command_all(unsigned int n);
void all_are(unsigned int n);

#endif
