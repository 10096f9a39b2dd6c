// SPDX-License-Identifier: GPL-2.0-or-later
/* Probing against a surface, on a pin, on an input, with the host's own motion. */
#include "tests/sim/talk.h"

#include "sim/bench.h"

static struct talk t;

static void probe_to(int32_t most, uint8_t input, uint8_t level)
{
	talk_begin(&t, 0x85, 0x23, 0x01, 0, 0);
	wire_put_i32(t.rq + 8, most);
	wire_put_f32(t.rq + 40, 0.1f);
	t.rq[44] = input;
	t.rq[45] = level;
	talk_send(&t);
}

static void put_probe(uint8_t pin)
{
	struct sim_switch probe = {
		.wired = true, .normally_open = true, .pin = pin, .from = 700, .to = INT32_MAX
	};

	sim_bench_switch(&t.dev, &t.dev.bench.machine.probe, &probe);
}

static void a_probe_latches_where_it_touches(void **state)
{
	int32_t latched;

	(void)state;
	talk_start_axes(&t, TALK_MOVING);
	put_probe(2);
	probe_to(5000, 3 + 8, 0);
	assert_int_equal(talk_engine_state(&t), SIM_PE_PROBING);
	assert_int_equal(talk_wait_while(&t, SIM_PE_PROBING), SIM_PE_PROBE_COMPLETE);
	assert_int_equal(talk_axis_state(&t, 0), SIM_AX_PROBED);
	talk_ask(&t, 0x85, 0x24, 0);
	latched = wire_get_i32(t.rp + 8);
	assert_int_equal(t.rp[40], 0x01);
	assert_in_range(latched, 700, 702);
	assert_in_range(talk_position(&t, 0) - latched, 17, 20);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOPPED);
	assert_int_equal(wire_get_i32(talk_ask(&t, 0x85, 0x24, 1) + 8), latched);
}

static void a_probe_on_an_external_input(void **state)
{
	(void)state;
	talk_start_axes(&t, TALK_MOVING);
	put_probe(SIM_PROBE_INPUT + 5);
	assert_int_equal(talk_status(&t)[62], 0x10);
	probe_to(5000, 5, 0);
	assert_int_equal(talk_wait_while(&t, SIM_PE_PROBING), SIM_PE_PROBE_COMPLETE);
	assert_int_equal(talk_status(&t)[62], 0);
}

static void a_probe_which_touches_nothing_is_an_error(void **state)
{
	(void)state;
	talk_start_axes(&t, TALK_MOVING);
	probe_to(-400, 3 + 8, 0);
	assert_int_equal(talk_wait_while(&t, SIM_PE_PROBING), SIM_PE_PROBE_ERROR);
	assert_int_equal(talk_position(&t, 0), -400);
	assert_int_equal(talk_axis_state(&t, 0), SIM_AX_READY);
	assert_int_equal(talk_ask(&t, 0x85, 0x24, 0)[40], 0);
}

static void a_probe_already_touching_latches_at_once(void **state)
{
	(void)state;
	talk_start_axes(&t, TALK_MOVING);
	probe_to(5000, 3 + 8, 1);
	assert_int_equal(talk_wait_while(&t, SIM_PE_PROBING), SIM_PE_PROBE_COMPLETE);
	assert_int_equal(wire_get_i32(talk_ask(&t, 0x85, 0x24, 0) + 8), 0);
}

static void a_hybrid_probe_watches_the_hosts_own_motion(void **state)
{
	int32_t latched;

	(void)state;
	talk_start_axes(&t, SIM_AC_ENABLED);
	put_probe(2);
	talk_set_state(&t, SIM_PE_RUNNING);
	talk_begin(&t, 0x85, 0x23, 0, 1, 0);
	t.rq[44] = 3 + 8;
	talk_send(&t);
	for (int i = 0; i < 100 && t.dev.engine.state == SIM_PE_RUNNING; i++) {
		talk_begin(&t, 0x85, 0xFF, 18, 3, 0);
		for (unsigned int k = 0; k < 18; k++)
			t.rq[8 + 3 * k] = 3;
		talk_send(&t);
		talk_wait(&t, 18);
	}
	talk_wait(&t, 5);
	assert_int_equal(talk_engine_state(&t), SIM_PE_HYBRID_COMPLETE);
	latched = wire_get_i32(talk_ask(&t, 0x85, 0x24, 1) + 8);
	assert_in_range(latched, 700, 703);
	assert_in_range(talk_position(&t, 0) - latched, 0, 3);
	talk_set_state(&t, SIM_PE_RUNNING);
	assert_int_equal(talk_engine_state(&t), SIM_PE_RUNNING);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_probe_latches_where_it_touches),
		cmocka_unit_test(a_probe_on_an_external_input),
		cmocka_unit_test(a_probe_which_touches_nothing_is_an_error),
		cmocka_unit_test(a_probe_already_touching_latches_at_once),
		cmocka_unit_test(a_hybrid_probe_watches_the_hosts_own_motion),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
