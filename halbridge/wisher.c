/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Ten times a second in the module's own thread: settings are not realtime's.
 *
 * The wish ends with the daemon that was told, so it is sent anew when another
 * one reports, when our session is another, and until sending succeeds. As
 * long as nobody has set anything, nothing is sent at all: a component that is
 * merely loaded has no wishes.
 */
#include "halbridge/wisher.h"
#include <math.h>
#include <stdio.h>

static void take_report(struct wisher *wisher, struct values *values, pokeys_client *client)
{
	struct pokeys_report *report = &wisher->report;

	if (pokeys_client_read_report(client, report))
		return;
	if (report->epoch == wisher->epoch && report->count == wisher->count)
		return;
	wisher->unsent |= report->epoch != wisher->epoch;
	wisher->epoch = report->epoch;
	wisher->count = report->count;
	wish_report(&wisher->wish, report, values);
}

static void send(struct wisher *wisher, pokeys_client *client, uint32_t session)
{
	wisher->wish.image.session = session;
	wisher->unsent = pokeys_client_write_wish(client, &wisher->wish.image) != 0;
	wisher->session = session;
}

void wisher_round(struct wisher *wisher, struct values *values, pokeys_client *client,
		  uint32_t session, wish_refuse refuse, void *argument)
{
	if (client)
		take_report(wisher, values, client);
	if (wish_look(&wisher->wish, values, refuse, argument) || wisher->session != session)
		wisher->unsent = true;
	if (client && wisher->unsent && wisher->wish.any)
		send(wisher, client, session);
}

void wisher_explain(const struct wish_item *item, const char *prefix, double value, char *line,
		    size_t size)
{
	char name[TABLE_NAME_MAX + 1];
	const struct table_row *row = item->name;

	table_full_name(row, prefix, item->index, name);
	if (item->row->unit->wanted && isfinite(value) && value >= row->low && value <= row->high)
		snprintf(line, size, "%s = %g: must be %s; the old value stays in use", name, value,
			 item->row->unit->wanted);
	else
		snprintf(line, size, "%s = %g: must be %g to %g; the old value stays in use", name,
			 value, row->low, row->high);
}
