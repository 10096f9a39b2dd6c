// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The choice of a way to wait, over every combination of what there is: auto
 * never takes what could not work or would starve somebody, and always says why.
 */
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <cmocka.h>
#include "daemon/control/waiting.h"

/* A machine that has everything. */
static const struct waiting_facts best = {
	.interface = "eth1",
	.card_napi = 1,
	.busy_poll_us = 200,
	.cpu = 2,
	.isolated = true,
};

static struct waiting choose(struct waiting_facts facts)
{
	struct waiting out;

	waiting_choose(&facts, &out);
	return out;
}

static void auto_spins_on_an_isolated_core_of_its_own(void **state)
{
	struct waiting out = choose(best);

	(void)state;
	assert_int_equal(out.wait, CONFIG_WAIT_SPIN);
	assert_int_equal(out.mode, LOOP_SPIN);
	assert_int_equal(out.busy_poll_us, 0);
	assert_non_null(strstr(out.why, "core 2 is isolated"));
}

static void auto_polls_the_card_where_it_may_not_spin(void **state)
{
	static const char *const whys[] = { "no core is given", "not isolated", "LinuxCNC takes" };

	(void)state;
	for (int i = 0; i < 3; i++) {
		struct waiting_facts facts = best;
		struct waiting out;

		facts.cpu = i == 0 ? -1 : 2;
		facts.isolated = i == 2;
		facts.servo = i == 2;
		out = choose(facts);
		assert_int_equal(out.wait, CONFIG_WAIT_NAPI);
		assert_int_equal(out.mode, LOOP_SLEEP);
		assert_int_equal(out.busy_poll_us, 200);
		assert_non_null(strstr(out.why, whys[i]));
		assert_non_null(strstr(out.why, "eth1 can be polled"));
	}
}

static void auto_sleeps_where_nothing_else_works_and_says_what_is_missing(void **state)
{
	static const struct {
		enum config_transport transport;
		int ring, ring_napi, card_napi;
		const char *interface;
		uint32_t busy_poll_us;
		const char *why;
	} lacking[] = {
		{ CONFIG_SOCKET, 0, 0, 1, "eth1", 200, "io_uring only" },
		{ CONFIG_XDP, 0, 0, 1, "eth1", 200, "io_uring only" },
		{ CONFIG_AUTO, -EPERM, -EPERM, 1, "eth1", 200, "no io_uring" },
		{ CONFIG_AUTO, 0, -EINVAL, 1, "eth1", 200, "Linux 6.9" },
		{ CONFIG_IO_URING, 0, 0, 1, "eth1", 0, "busy-poll-us = 0" },
		{ CONFIG_AUTO, 0, 0, 0, "", 200, "no interface is named" },
		{ CONFIG_AUTO, 0, 0, 0, "eth1", 200, "eth1 cannot be polled" },
		{ CONFIG_AUTO, 0, 0, -ENOENT, "eth1", 200, "does not say whether eth1" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(lacking) / sizeof(lacking[0]); i++) {
		struct waiting out = choose((struct waiting_facts){
			.transport = lacking[i].transport,
			.ring = lacking[i].ring,
			.ring_napi = lacking[i].ring_napi,
			.card_napi = lacking[i].card_napi,
			.interface = lacking[i].interface,
			.busy_poll_us = lacking[i].busy_poll_us,
			.cpu = -1 });

		assert_int_equal(out.wait, CONFIG_WAIT_SLEEP);
		assert_int_equal(out.mode, LOOP_SLEEP);
		assert_int_equal(out.busy_poll_us, 0);
		assert_false(out.refused);
		if (!strstr(out.why, lacking[i].why))
			fail_msg("\"%s\" does not say \"%s\"", out.why, lacking[i].why);
		assert_non_null(strstr(out.why, "not spin, for no core"));
	}
}

static void what_is_asked_for_by_name_is_taken(void **state)
{
	struct waiting_facts facts = best;

	(void)state;
	facts.wanted = CONFIG_WAIT_SLEEP;
	assert_int_equal(choose(facts).wait, CONFIG_WAIT_SLEEP);
	facts.wanted = CONFIG_WAIT_NAPI;
	assert_int_equal(choose(facts).wait, CONFIG_WAIT_NAPI);
	facts.interface = ""; /* his word that its card can */
	facts.card_napi = 0;
	assert_int_equal(choose(facts).busy_poll_us, 200);
	facts.wanted = CONFIG_WAIT_SPIN;
	facts.isolated = false;
	assert_int_equal(choose(facts).mode, LOOP_SPIN);
}

static void napi_that_is_not_to_be_had_is_refused_in_words(void **state)
{
	struct waiting_facts facts = best;
	struct waiting out;

	(void)state;
	facts.wanted = CONFIG_WAIT_NAPI;
	facts.ring_napi = -EINVAL;
	out = choose(facts);
	assert_true(out.refused);
	assert_int_equal(out.wait, CONFIG_WAIT_SLEEP);
	assert_int_equal(out.busy_poll_us, 0);
	assert_non_null(strstr(out.why, "Linux 6.9"));
}

/* Every combination at once: what may never be, and that something is always said. */
static void no_combination_breaks_a_rule(void **state)
{
	(void)state;
	for (unsigned int bits = 0; bits < 1u << 9; bits++)
		for (int wanted = 0; wanted < 4; wanted++)
			for (int transport = 0; transport < 4; transport++) {
				struct waiting_facts f = {
					.wanted = (enum config_wait)wanted,
					.transport = (enum config_transport)transport,
					.ring = bits & 1 ? -EPERM : 0,
					.ring_napi = bits & 2 ? -EINVAL : 0,
					.card_napi = (int)(bits >> 2 & 3) - 1,
					.interface = bits & 16 ? "eth1" : "",
					.busy_poll_us = bits & 32 ? 100 : 0,
					.cpu = bits & 64 ? 3 : -1,
					.isolated = bits & 128,
					.servo = bits & 256,
				};
				struct waiting out = choose(f);
				bool ring = transport != CONFIG_SOCKET && transport != CONFIG_XDP &&
					    !f.ring && !f.ring_napi;

				assert_int_not_equal(out.wait, CONFIG_WAIT_AUTO);
				assert_true(*out.why);
				assert_int_equal(out.mode == LOOP_SPIN,
						 out.wait == CONFIG_WAIT_SPIN);
				assert_true(out.wait == CONFIG_WAIT_NAPI || !out.busy_poll_us);
				assert_true(out.wait != CONFIG_WAIT_NAPI || ring);
				assert_int_equal(out.refused, wanted == CONFIG_WAIT_NAPI && !ring);
				if (wanted == CONFIG_WAIT_SPIN || wanted == CONFIG_WAIT_SLEEP)
					assert_int_equal(out.wait, wanted);
				if (wanted == CONFIG_WAIT_AUTO && out.wait == CONFIG_WAIT_SPIN)
					assert_true(f.cpu >= 0 && f.isolated && !f.servo);
				if (wanted == CONFIG_WAIT_AUTO && out.wait == CONFIG_WAIT_NAPI)
					assert_true(f.card_napi > 0 && *f.interface);
			}
}

static void lists_of_cores_are_read_as_the_kernel_writes_them(void **state)
{
	static const struct {
		const char *list;
		int cpu;
		bool in, highest;
	} cases[] = {
		{ "", 0, false, false },          { "\n", 0, false, false },
		{ "2\n", 2, true, true },         { "2-3\n", 2, true, false },
		{ "2-3\n", 3, true, true },       { "2-3\n", 4, false, false },
		{ "1,3-5,7\n", 4, true, false },  { "1,3-5,7\n", 7, true, true },
		{ "1,3-5,7\n", 6, false, false }, { "0-1\n", -1, false, false },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		bool highest;

		assert_int_equal(waiting_in_list(cases[i].list, cases[i].cpu, &highest),
				 cases[i].in);
		assert_int_equal(highest, cases[i].highest);
	}
}

static void looking_around_finds_no_card_where_none_is_named(void **state)
{
	struct waiting_facts facts;
	struct config config = { .cpu = -1, .busy_poll_us = 200 };

	(void)state;
	waiting_look(&config, &facts);
	assert_int_equal(facts.card_napi, 0);
	assert_false(facts.isolated);
	assert_int_equal(choose(facts).wait, CONFIG_WAIT_SLEEP);
	strcpy(config.interface, "nosuchif0");
	waiting_look(&config, &facts);
	assert_int_equal(facts.card_napi, -ENODEV);
	strcpy(config.interface, "lo"); /* has no queue to poll */
	waiting_look(&config, &facts);
	assert_true(facts.card_napi <= 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(auto_spins_on_an_isolated_core_of_its_own),
		cmocka_unit_test(auto_polls_the_card_where_it_may_not_spin),
		cmocka_unit_test(auto_sleeps_where_nothing_else_works_and_says_what_is_missing),
		cmocka_unit_test(what_is_asked_for_by_name_is_taken),
		cmocka_unit_test(napi_that_is_not_to_be_had_is_refused_in_words),
		cmocka_unit_test(no_combination_breaks_a_rule),
		cmocka_unit_test(lists_of_cores_are_read_as_the_kernel_writes_them),
		cmocka_unit_test(looking_around_finds_no_card_where_none_is_named),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
